#include "deploy/worlds/fairness.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "deploy/worlds/walkers.h"

namespace chase::worlds {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

namespace {

constexpr double kTargetRoom = 0.12;   // m around target and carrier
constexpr double kDroneRoom = 0.58;    // m: radius 0.25 and 0.3, and what lies between samples
constexpr double kImageMargin = 25.0;  // px
constexpr double kStep = 0.05;         // s
constexpr double kStands = 0.95;       // share of the time in which the chaser has a place to be
constexpr double kBolt = 1.5;      // m/s from one instant to the next: more than a walker's step
constexpr double kBoltRoom = 4.0;  // m: 4 m/s for the second that it takes to see it and give way

/// Everything about one world that the checks look at.
struct Look {
  const world::Scenario& scenario;
  std::vector<Solid> solids = world::StaticSolids(scenario);
  world::PathMotion path = world::TargetMotion(scenario);
  double end = std::min(scenario.duration_s, path.Duration());

  double Ground(const Vector2d& p) const {
    return world::GroundHeight(scenario.world.ground, p.x(), p.y());
  }
  Vector3d Target(double t) const {
    const Vector2d p = path.Position(t);
    return {p.x(), p.y(), Ground(p) + scenario.target.base + 0.5 * scenario.target.height};
  }
  Vector3d Hover() const {
    return scenario.chaser.start + Vector3d(0.0, 0.0, scenario.chaser.takeoff_height);
  }
  double FlightHeight(const Vector2d& p) const {
    return Ground(p) + scenario.chaser.takeoff_height + 0.12;
  }
  double Clearance(const Vector3d& p) const {
    double least = 1e9;
    for (const Solid& solid : solids) least = std::min(least, SignedDistance(solid, p));
    return least;
  }
  bool Blocked(const Vector3d& p, const Vector3d& q) const {
    return std::any_of(solids.begin(), solids.end(),
                       [&](const Solid& solid) { return SegmentHits(solid, p, q); });
  }
};

std::string WayProblem(const Look& look) {
  const double reach = TargetReach(look.scenario.target) + kTargetRoom;
  const double top = look.scenario.target.base + look.scenario.target.height;
  for (double t = 0.0; t <= look.path.Duration(); t += kStep) {
    const Vector2d p = look.path.Position(t);
    const double foot = look.Ground(p);
    for (const double z : {foot + 0.25, foot + top})
      if (look.Clearance({p.x(), p.y(), z}) < reach)
        return fmt::format("the target has no room at {:.1f} s", t);
    if (look.Clearance({p.x(), p.y(), look.FlightHeight(p)}) < kDroneRoom)
      return fmt::format("the drone has no room above the target's way at {:.1f} s", t);
  }
  if (look.path.Duration() < look.scenario.duration_s - 3.0) return "the target's way is too short";
  return "";
}

std::string StartProblem(const Look& look, const world::Rig& rig, bool hidden) {
  const Vector3d start = look.scenario.chaser.start, hover = look.Hover();
  for (double z = 0.0; z <= look.scenario.chaser.takeoff_height + 0.3; z += 0.1)
    if (look.Clearance(start + Vector3d(0.0, 0.0, z)) < kDroneRoom) return "no room to climb";
  for (double t = 0.0; t < 5.0; t += kStep)
    if ((look.Target(t) - hover).head<2>().norm() < 1.2) return "the target drives at the drone";
  const Vector3d target = look.Target(0.0);
  if (look.Blocked(hover, target)) return "the target is hidden at the start";
  const double yaw = look.scenario.chaser.yaw_deg * kPi / 180.0;
  const Eigen::AngleAxisd R_WB(yaw, Vector3d::UnitZ());
  const Vector3d p_B = R_WB.inverse() * (target - hover);
  const Vector3d p_C = rig.R_BC().transpose() * (p_B - rig.camera_position);
  const Vector2d px = p_C.z() > 0.1 ? rig.Project(p_C) : Vector2d(-1.0, -1.0);
  const Area image{{0.0, 0.0}, {rig.width_px - 1.0, rig.height_px - 1.0}};
  if (image.Contains(px, kImageMargin) == hidden)
    return hidden ? "the target is in the image at the start" : "the target is out of the image";
  return "";
}

std::string MoverProblem(const Look& look, const world::MoverSpec& mover) {
  const double reach = TargetReach(look.scenario.target) + kWalkerToTarget;
  const double chase = look.scenario.chaser.desired_distance + kBoltRoom;
  double speed = world::MoverAt(mover, 0.0).velocity.norm();
  for (double t = 0.0; t <= look.scenario.duration_s; t += kStep) {
    const auto [body, velocity] = world::MoverAt(mover, t);
    const bool bolts = velocity.norm() > speed + kBolt;
    speed = velocity.norm();
    const auto away = [&body = body](const Vector3d& p) {
      return SignedDistance(body, {p.x(), p.y(), body.center.z()});
    };
    if (away(look.Target(t)) < reach) return fmt::format("a mover meets the target at {:.1f} s", t);
    if (t < 3.0 && away(look.Hover()) < 1.2) return "a mover comes to the hovering drone";
    if (bolts && away(look.Target(t)) < chase)
      return fmt::format("a mover sets off beside the chase at {:.1f} s", t);
    const double size = body.half_size.head<2>().norm();
    const bool round = body.kind == Solid::Kind::kCylinder;
    const Vector3d low = body.center - Vector3d(0.0, 0.0, 0.8 * body.half_size.z());
    for (const Solid& solid : look.solids) {
      if ((solid.center - body.center).norm() > solid.half_size.norm() + size + 1.0) continue;
      const double d = std::min(SignedDistance(solid, body.center), SignedDistance(solid, low));
      const double room = round ? d - body.half_size.x()
                                : away(solid.center) - solid.half_size.head<2>().maxCoeff();
      if (solid.kind == Solid::Kind::kEllipsoid && solid.center.z() > 4.0) continue;  // crowns
      if (room < 0.05) return fmt::format("a mover runs into something at {:.1f} s", t);
    }
  }
  return "";
}

/// A place about the desired distance from the target, with room for the drone, that sees it.
bool HasStand(const Look& look, double t) {
  const Vector3d target = look.Target(t);
  for (const double share : {1.0, 0.75, 1.3})
    for (int i = 0; i < 24; ++i) {
      const Vector2d p = target.head<2>() +
                         Polar(2.0 * kPi * i / 24.0, share * look.scenario.chaser.desired_distance);
      const Vector3d stand(p.x(), p.y(), look.FlightHeight(p));
      if (look.Clearance(stand) > 0.5 && !look.Blocked(stand, target)) return true;
    }
  return false;
}

std::string StandProblem(const Look& look) {
  int stands = 0, instants = 0;
  for (double t = 0.0; t < look.scenario.duration_s; t += 1.0, ++instants)
    stands += HasStand(look, t);
  return stands < kStands * instants ? "the chaser has no place that sees the target" : "";
}

}  // namespace

std::string Unfairness(const world::Scenario& scenario, const world::Rig& rig,
                       const Options& options) {
  std::string problem = scenario.Problem();
  if (!problem.empty()) return problem;
  const Look look{scenario};
  problem = WayProblem(look);
  if (problem.empty()) problem = StartProblem(look, rig, options.hidden_start);
  for (const auto& mover : scenario.movers)
    if (problem.empty()) problem = MoverProblem(look, mover);
  return problem.empty() ? StandProblem(look) : problem;
}

}  // namespace chase::worlds
