#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "services/simulator/imu.h"
#include "services/simulator/own_mode.h"

namespace chase::simulator {

/// A pose of external vision in its frame O.
struct Vision {
  int64_t utime = 0;  ///< when it was measured, us
  Eigen::Vector3d p_OB = Eigen::Vector3d::Zero(), v_OB = Eigen::Vector3d::Zero();  ///< m, m/s
  double yaw = 0.0;                                                                ///< rad
  int resets = 0;                                                                  ///< of O
};

/// The autopilot's estimator, as PX4's with EKF2_EV_CTRL 15 and neither GPS nor magnetometer:
/// place, level velocity and heading are vision's, in its frame O; between its poses and after them
/// the accelerometer's, so that they drift. Attitude and vertical velocity (by a barometer) are the
/// truth.
class Estimator {
 public:
  /// The true state and what is measured there; times rise.
  void Predict(int64_t utime, const BodyState& body, const Eigen::Vector3d& accel);
  /// The first pose and those with another count of resets are taken over, the others followed.
  /// A velocity that is not finite is not known.
  void Correct(const Vision& vision);

  Px4Body Body(const BodyState& body) const;  ///< the state in O, and which of it is known; no more
  /// R_WB of R_OB.
  Eigen::Quaterniond InWorld(const Eigen::Quaterniond& R_OB) const;

 private:
  struct Past {
    int64_t utime;
    Eigen::Vector3d p, v;
    double yaw;
  };
  std::deque<Past> past_;        // a second
  std::optional<int64_t> seen_;  // the last pose of vision
  Eigen::Vector3d p_WO_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_error_ = Eigen::Vector3d::Zero();  // estimate minus truth, level, frame W, m/s
  double yaw_WO_ = 0.0;
  int resets_ = -1, times_reset_ = 0;
};

}  // namespace chase::simulator
