#include "services/simulator/actors.h"

#include <algorithm>
#include <cmath>

namespace chase::simulator {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

Actors::Actors(const world::Scenario& scenario)
    : target_(scenario.target),
      ground_(scenario.world.ground),
      movers_(scenario.movers),
      path_(world::TargetMotion(scenario)) {}

/// Direction of travel; at rest, that of the motion next to it.
double Actors::Heading(double t) const {
  const double moving = std::clamp(t, 0.05, std::max(0.05, path_.Duration() - 0.05));
  Vector2d v = path_.Velocity(moving);
  if (v.norm() <= 1e-9) v = path_.Direction(moving);
  return std::atan2(v.y(), v.x());
}

TargetState Actors::Target(double t) const {
  const Vector2d p = path_.Position(t), v = path_.Velocity(t);
  const double foot = world::GroundHeight(ground_, p.x(), p.y());
  const double next = world::GroundHeight(ground_, p.x() + 1e-3 * v.x(), p.y() + 1e-3 * v.y());
  TargetState state;
  state.center = {p.x(), p.y(), foot + target_.base + 0.5 * target_.height};
  state.velocity = {v.x(), v.y(), (next - foot) / 1e-3};
  state.yaw = Heading(t);
  state.cylinder = world::TargetSolid(target_, state.center, state.yaw);
  state.has_carrier = target_.carrier_size.minCoeff() > 0.0;
  state.carrier = {Solid::Kind::kBox, Vector3d(p.x(), p.y(), foot + 0.5 * target_.carrier_size.z()),
                   0.5 * target_.carrier_size, state.yaw};
  return state;
}

std::vector<world::MoverState> Actors::Movers(double t) const {
  std::vector<world::MoverState> states;
  for (const auto& mover : movers_) states.push_back(world::MoverAt(mover, t));
  return states;
}

}  // namespace chase::simulator
