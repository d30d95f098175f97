#include "services/odometry/sweep_clock.h"

#include <cmath>

namespace chase::odometry {

namespace {

constexpr double kLatest = 0.5;     // s; messages are called late up to 0.3 s
constexpr double kSame = 0.05;      // s: a clock that is this near to its old self is right again
constexpr double kSmoothing = 0.1;  // of the usual delay, share of a sweep

}  // namespace

double SweepClock::Correction(double end, double imu_t) {
  const bool alive = imu_t > last_imu_t_;  // else the IMU is silent: that is no step
  last_imu_t_ = imu_t;
  if (!alive) return offset_;
  const double off = imu_t - end - usual_;
  if (std::abs(off - offset_) > kLatest) offset_ = std::abs(off) < kSame ? 0.0 : off;
  if (offset_ == 0.0 && std::abs(off) < kLatest) usual_ += kSmoothing * off;
  return offset_;
}

}  // namespace chase::odometry
