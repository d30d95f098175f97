#include "services/odometry/standing.h"

#include <algorithm>
#include <cmath>

namespace chase::odometry {

namespace {

constexpr size_t kWindow = 20;       // samples averaged
constexpr double kSigmas = 5.0;      // a mean so many of its deviations off is a motion
constexpr double kBiasTime = 10.0;   // s over which the mean at rest may wander with the bias
constexpr double kSeenMoved = 0.05;  // m
constexpr size_t kBlocks = 10;       // of a window each, that must agree before it stands again
constexpr double kSlow = 0.05;       // m/s, below which the estimate shows no motion
// Of a sample's deviation: below, the unit would be better than any; above, something shook it.
constexpr double kLeastAccel = 0.01, kMostAccel = 0.05;  // m/s^2
constexpr double kLeastGyro = 0.001, kMostGyro = 0.005;  // rad/s

}  // namespace

void Standing::Begin(const ImuSample& mean, double accel_spread, double gyro_spread,
                     const Eigen::Vector3d& p) {
  holds_ = true;
  p_ = p;
  mean_ = mean;
  gyro_ = mean.gyro;
  const double factor = kSigmas / std::sqrt(static_cast<double>(kWindow));
  accel_limit_ = factor * std::clamp(accel_spread, kLeastAccel, kMostAccel);
  gyro_limit_ = factor * std::clamp(gyro_spread, kLeastGyro, kMostGyro);
  window_.clear();
}

void Standing::Add(const ImuSample& imu, const NavState& state) {
  if (holds_) return Watch(imu);
  block_.accel += imu.accel, block_.accel2 += imu.accel.cwiseAbs2();
  block_.gyro += imu.gyro, block_.gyro2 += imu.gyro.cwiseAbs2();
  mean_.t = imu.t;
  if (++block_.n == static_cast<int>(kWindow)) Close(state);
}

void Standing::Watch(const ImuSample& imu) {
  window_.push_back(imu);
  if (window_.size() < kWindow) return;
  Eigen::Vector3d accel = Eigen::Vector3d::Zero(), gyro = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : window_) accel += sample.accel, gyro += sample.gyro;
  accel = accel / static_cast<double>(kWindow) - mean_.accel;
  gyro = gyro / static_cast<double>(kWindow) - mean_.gyro;
  if (accel.cwiseAbs().maxCoeff() > accel_limit_ || gyro.cwiseAbs().maxCoeff() > gyro_limit_)
    holds_ = false;
  gyro_ = mean_.gyro + gyro;
  const double share =
      std::clamp((imu.t - window_.front().t) / kBiasTime, 0.0, 1.0) / static_cast<double>(kWindow);
  mean_.accel += share * accel;
  mean_.gyro += share * gyro;
  window_.pop_front();
}

/// The newest block is full. Where all of them agree within the noise that they themselves show,
/// and the gyroscope shows its bias, the body stands again.
void Standing::Close(const NavState& state) {
  blocks_.push_back(block_);
  block_ = {};
  if (blocks_.size() > kBlocks) blocks_.pop_front();
  if (blocks_.size() < kBlocks || state.v.norm() > kSlow) return;
  const double n = static_cast<double>(kWindow), all = n * static_cast<double>(kBlocks);
  ImuSample mean;
  Eigen::Vector3d accel2 = Eigen::Vector3d::Zero(), gyro2 = Eigen::Vector3d::Zero();
  for (const Block& block : blocks_) {
    mean.accel += block.accel / all, mean.gyro += block.gyro / all;
    accel2 += (block.accel2 - block.accel.cwiseAbs2() / n) / all;
    gyro2 += (block.gyro2 - block.gyro.cwiseAbs2() / n) / all;
  }
  const double accel_spread = std::sqrt(accel2.maxCoeff()),
               gyro_spread = std::sqrt(gyro2.maxCoeff());
  if (accel_spread > kMostAccel || gyro_spread > kMostGyro) return;
  if ((mean.gyro - state.gyro_bias).cwiseAbs().maxCoeff() > kMostGyro) return;
  const double factor = kSigmas / std::sqrt(n);
  for (const Block& block : blocks_) {
    const double accel = (block.accel / n - mean.accel).cwiseAbs().maxCoeff();
    const double gyro = (block.gyro / n - mean.gyro).cwiseAbs().maxCoeff();
    if (accel > factor * accel_spread || gyro > factor * gyro_spread) return;
  }
  blocks_.clear();
  Begin(mean, accel_spread, gyro_spread, state.p);
}

void Standing::See(const Eigen::Vector3d& p) {
  if ((p - p_).norm() > kSeenMoved) holds_ = false;
}

}  // namespace chase::odometry
