#pragma once

namespace chase::odometry {

/// Puts sweeps on the IMU's clock where the LiDAR's has stepped. A sweep comes when it ends, and
/// the newest inertial sample is of then: whoever is off from that by more than messages are ever
/// late goes by another clock. Less may be either and is left alone.
class SweepClock {
 public:
  /// What to add to the stamps of a sweep, s. By its own stamps it ends at `end`; the newest
  /// inertial sample is of `imu_t`.
  double Correction(double end, double imu_t);
  bool stepped() const { return offset_ != 0.0; }

 private:
  double offset_ = 0.0;
  double usual_ = 0.0;         // that a sweep ends before the newest sample, s
  double last_imu_t_ = -1e18;  // when the sweep before came
};

}  // namespace chase::odometry
