#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/scenario.h"

namespace chase::simulator {

/// The target at one time: the solid to chase, by default an upright cylinder, on its carrier.
/// Frame W.
struct TargetState {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< p_WT, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double yaw = 0.0;  ///< of the carrier, rad
  world::Solid cylinder, carrier;
  bool has_carrier = false;
};

/// All that moves in the world but the drone, as a function of mission time [s].
class Actors {
 public:
  explicit Actors(const world::Scenario& scenario);
  TargetState Target(double t) const;
  std::vector<world::MoverState> Movers(double t) const;

 private:
  double Heading(double t) const;

  world::TargetSpec target_;
  world::GroundSpec ground_;
  std::vector<world::MoverSpec> movers_;
  world::PathMotion path_;
};

}  // namespace chase::simulator
