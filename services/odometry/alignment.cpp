#include "services/odometry/alignment.h"

#include <cmath>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

constexpr double kFewestSamples = 20.0;

void SetBlock(int block, double sigma, ErrorCovariance* P) {
  P->block<3, 3>(block, block) = sigma * sigma * Eigen::Matrix3d::Identity();
}

double Spread(const Eigen::Vector3d& squares, const Eigen::Vector3d& mean, double n) {
  return std::sqrt((squares / n - mean.cwiseAbs2()).cwiseMax(0.0).maxCoeff());
}

}  // namespace

void Alignment::Add(const ImuSample& imu) {
  if (n_ == 0.0) first_t_ = imu.t;
  last_ = imu;
  n_ += 1.0;
  sum_accel_ += imu.accel;
  sum_gyro_ += imu.gyro;
  squares_accel_ += imu.accel.cwiseAbs2();
  squares_gyro_ += imu.gyro.cwiseAbs2();
}

bool Alignment::Complete() const {
  return n_ >= kFewestSamples && last_.t - first_t_ >= config_.duration;
}

bool Alignment::AtRest() const {
  return Spread(squares_gyro_, MeanGyro(), n_) < config_.still_rate &&
         MeanGyro().norm() < config_.still_rate &&
         Spread(squares_accel_, MeanAccel(), n_) < config_.still_accel;
}

void Alignment::SetBiasCovariance(const FilterConfig& filter, NavState* state) const {
  SetBlock(kAccelBias, filter.accel_bias_sigma, &state->P);
  SetBlock(kGyroBias, AtRest() ? filter.gyro_bias_sigma : 0.05, &state->P);
  // W is level by definition of the first attitude; how level that is remains to be learnt.
  const double tilt = AtRest() ? filter.accel_bias_sigma : 1.5;  // m/s^2
  SetBlock(kGravity, tilt, &state->P);
  state->P(kGravity + 2, kGravity + 2) = 1e-6;
}

NavState Alignment::Result(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const {
  NavState state;
  const Eigen::Vector3d f = MeanAccel();
  const double roll = std::atan2(f.y(), f.z());
  const double pitch = std::atan2(-f.x(), std::hypot(f.y(), f.z()));
  state.t = last_.t;
  state.p = p;
  state.R_WB = math::FromYaw(yaw) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  state.g = {0.0, 0.0, -filter.gravity};
  if (AtRest()) state.gyro_bias = MeanGyro();
  SetBlock(kP, 1e-3, &state.P);
  SetBlock(kV, AtRest() ? 0.01 : 2.0, &state.P);
  SetBlock(kTheta, AtRest() ? 1e-3 : 0.02, &state.P);
  SetBiasCovariance(filter, &state);
  return state;
}

NavState Alignment::ResultAt(const FilterConfig& filter, const NavState& known) const {
  NavState state = known;
  const Eigen::Vector3d up = known.R_WB * MeanAccel();
  state.g = -filter.gravity * up.normalized();
  if (AtRest()) state.gyro_bias = MeanGyro();
  SetBiasCovariance(filter, &state);
  SetBlock(kGravity, 0.5, &state.P);
  return state;
}

}  // namespace chase::odometry
