#include "services/odometry/standing.h"

#include <algorithm>
#include <cmath>

namespace chase::odometry {

namespace {

constexpr size_t kWindow = 20;       // samples averaged
constexpr double kSigmas = 5.0;      // a mean so many of its deviations off is a motion
constexpr double kBiasTime = 10.0;   // s over which the mean at rest may wander with the bias
constexpr double kSeenMoved = 0.05;  // m
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

void Standing::Add(const ImuSample& imu) {
  if (!holds_) return;
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

void Standing::See(const Eigen::Vector3d& p) {
  if ((p - p_).norm() > kSeenMoved) holds_ = false;
}

}  // namespace chase::odometry
