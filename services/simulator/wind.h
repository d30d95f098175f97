#pragma once

#include <Eigen/Core>

#include "common/world/random.h"
#include "common/world/scenario.h"

namespace chase::simulator {

/// Wind with gusts: an Ornstein-Uhlenbeck process about the mean, half as strong upwards. m/s, W.
class Wind {
 public:
  Wind(const world::WindSpec& spec, uint64_t seed);
  /// Advances by dt [s] with the process's exact transition.
  void Step(double dt);
  Eigen::Vector3d velocity() const { return spec_.mean + gust_; }

 private:
  world::WindSpec spec_;
  world::Random random_;
  Eigen::Vector3d gust_ = Eigen::Vector3d::Zero();
};

}  // namespace chase::simulator
