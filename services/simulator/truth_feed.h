#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/bus/bus.h"
#include "common/world/obstacle.h"
#include "common/world/rig.h"
#include "common/world/scenario.h"
#include "services/simulator/simulator.h"

namespace chase::simulator {

/// Shape R of an ellipsoid that encloses the solid: itself for an ellipsoid, the smallest for a
/// box, and for an upright cylinder one that stays close to its side. Frame W.
Eigen::Matrix3d EnclosingShape(const world::Solid& solid);

/// Stands in for odometry, perception and mapping in scenarios that are fed the truth: POSE at
/// 200 Hz, TARGET at 20 Hz, OBSTACLES at 10 Hz.
class TruthFeed {
 public:
  TruthFeed(bus::Bus& bus, const world::Scenario& scenario, const world::Rig& rig);

  /// `tick` counts the 5 ms ticks of the node.
  void Publish(const Truth& truth, int64_t utime, int64_t tick);

 private:
  using Ranked = std::pair<double, const world::Obstacle*>;  // distance from the drone, m

  std::vector<Ranked> NearestStatics(const Eigen::Vector3d& p_WB) const;
  void PublishPose(const Truth& truth, int64_t utime);
  void PublishTarget(const Truth& truth, int64_t utime);
  void PublishObstacles(const Truth& truth, int64_t utime);

  bus::Bus& bus_;
  world::Rig rig_;
  std::vector<world::Obstacle> statics_;
  std::vector<double> reach_;  // m, of each static solid around its centre
};

}  // namespace chase::simulator
