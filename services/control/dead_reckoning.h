#pragma once

#include <deque>

#include "common/math/rotation.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// How the body goes on after the last pose that was good, by what has been asked of it since: the
/// attitude loop needs no pose. Good for the second or two that braking takes: a gust of 1 m/s that
/// it does not know is 0.25 m/s^2.
class DeadReckoning {
 public:
  explicit DeadReckoning(const ControlConfig& config) : drag_(config.drag) {}

  /// Goes on from `estimate`, of time t, s, by what has been asked for since: a pose may come late.
  void Begin(double t, const Estimate& estimate);
  /// From time t on the body does as `asked`, its motors give `gain` times that thrust, and a wind
  /// takes `trim`, m/s^2, to stand against.
  void Ask(double t, const Setpoint& asked, double gain, const Eigen::Vector3d& trim);
  /// Velocity and attitude at time t, s.
  const Estimate& At(double t);
  /// The clock was set by `by`, s.
  void Shift(double by);
  /// Frame W has turned by `yaw`, rad.
  void Turn(double yaw);

 private:
  struct Asked {
    double t;  // s
    Setpoint setpoint;
    double thrust;  // as the motors give it, m/s^2
    Eigen::Vector3d trim;
  };
  void Follow(const Asked& asked, double until);

  Eigen::Vector3d drag_;  // 1/s
  double t_ = 0.0;
  std::deque<Asked> asked_;  // in order of time
  Estimate estimate_;
};

}  // namespace chase::control
