#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>

#include "services/simulator/px4.h"
#include "services/simulator/quadrotor.h"

namespace chase::simulator {

/// Where the autopilot takes the world's origin and heading from: external vision alone, as PX4's
/// estimator does with EKF2_EV_CTRL 15 and neither GPS nor magnetometer. Roll, pitch and what the
/// body does are the truth; O is vision's frame.
class VisionFrame {
 public:
  /// The true state; times rise.
  void AddTruth(int64_t utime, const BodyState& body);
  /// A pose by vision, measured at `utime`. The first one and those with another count of resets
  /// are taken over, the others followed.
  void AddVision(int64_t utime, const Eigen::Vector3d& p_OB, double yaw, int resets);

  Px4Body InVision(const BodyState& body) const;  ///< p, v and R only
  /// R_WB of one relative to O.
  Eigen::Quaterniond InWorld(const Eigen::Quaterniond& R_OB) const;

 private:
  struct Past {
    int64_t utime;
    Eigen::Vector3d p;
    double yaw;
  };
  std::deque<Past> past_;  // a second
  Eigen::Vector3d p_WO_ = Eigen::Vector3d::Zero();
  double yaw_WO_ = 0.0;
  int resets_ = -1;
};

}  // namespace chase::simulator
