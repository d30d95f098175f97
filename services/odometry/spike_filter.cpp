#include "services/odometry/spike_filter.h"

namespace chase::odometry {

namespace {

double Largest(const Eigen::Vector3d& v) { return v.cwiseAbs().maxCoeff(); }

}  // namespace

bool SpikeFilter::Saturated(const ImuSample& imu) const {
  return Largest(imu.accel) >= config_.full_accel || Largest(imu.gyro) >= config_.full_rate;
}

bool SpikeFilter::Near(const ImuSample& a, const ImuSample& b) const {
  return Largest(a.accel - b.accel) < config_.accel_jump &&
         Largest(a.gyro - b.gyro) < config_.rate_jump;
}

std::vector<ImuSample> SpikeFilter::Take(const ImuSample& imu) {
  if (Saturated(imu)) return {};
  std::vector<ImuSample> out;
  if (last_ && !Near(*last_, imu)) {
    if (!waiting_ || !Near(*waiting_, imu)) {
      waiting_ = imu;
      return {};
    }
    out.push_back(*waiting_);
  }
  waiting_.reset();
  last_ = imu;
  out.push_back(imu);
  return out;
}

}  // namespace chase::odometry
