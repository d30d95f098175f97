#include "services/odometry/alignment.h"

#include <cmath>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

constexpr size_t kFewestSamples = 20;
// Halves of the window whose means differ by more are of a body that still moves a little.
constexpr double kSettledGyro = 0.002;      // rad/s
constexpr double kSettledAccel = 0.03;      // m/s^2
constexpr double kTiltInMotion = 1.5;       // m/s^2, of gravity's horizontal part
constexpr double kGravityStrength = 1e-3;   // m/s^2, how well |g| is known
constexpr double kGyroBiasInMotion = 0.05;  // rad/s
constexpr double kLongestGap = 0.03;        // s between samples over which a motion is followed

void SetBlock(int block, double sigma, ErrorCovariance* P) {
  P->block<3, 3>(block, block) = sigma * sigma * Eigen::Matrix3d::Identity();
}

double Spread(const Eigen::Vector3d& squares, const Eigen::Vector3d& mean, double n) {
  return std::sqrt((squares / n - mean.cwiseAbs2()).cwiseMax(0.0).maxCoeff());
}

}  // namespace

void Alignment::Add(const ImuSample& imu) {
  if (window_.empty()) first_t_ = imu.t;
  all_.push_back(imu);
  window_.push_back(imu);
  while (window_.size() > kFewestSamples && imu.t - window_[1].t >= config_.duration)
    window_.pop_front();
}

bool Alignment::Complete() const {
  if (window_.size() < kFewestSamples) return false;
  const double t = window_.back().t;
  if (t - window_.front().t < config_.duration) return false;
  if (t - first_t_ >= config_.patience) return true;
  const size_t half = window_.size() / 2;
  const ImuStatistics older = Statistics(0, half), newer = Statistics(half, window_.size());
  if (!AtRest(newer)) return true;  // it flies
  return AtRest() && (newer.mean.gyro - older.mean.gyro).norm() < kSettledGyro &&
         (newer.mean.accel - older.mean.accel).norm() < kSettledAccel;
}

ImuStatistics Alignment::Statistics(size_t begin, size_t end) const {
  Eigen::Vector3d accel2 = Eigen::Vector3d::Zero(), gyro2 = Eigen::Vector3d::Zero();
  ImuStatistics s;
  const double n = static_cast<double>(end - begin);
  for (size_t i = begin; i < end; ++i) {
    s.mean.accel += window_[i].accel / n;
    s.mean.gyro += window_[i].gyro / n;
    accel2 += window_[i].accel.cwiseAbs2();
    gyro2 += window_[i].gyro.cwiseAbs2();
  }
  s.mean.t = window_[end - 1].t;
  s.accel_spread = Spread(accel2, s.mean.accel, n);
  s.gyro_spread = Spread(gyro2, s.mean.gyro, n);
  return s;
}

bool Alignment::AtRest(const ImuStatistics& s) const {
  return s.gyro_spread < config_.still_rate && s.mean.gyro.norm() < config_.still_rate &&
         s.accel_spread < config_.still_accel;
}

void Alignment::SetBiases(const FilterConfig& filter, NavState* state) const {
  SetBlock(kAccelBias, filter.accel_bias_sigma, &state->P);
  if (AtRest()) {
    SetBlock(kGyroBias, filter.gyro_bias_sigma, &state->P);
    state->gyro_bias = statistics().mean.gyro;
    return CoupleTiltAndBias(filter, state);
  }
  SetBlock(kGyroBias, kGyroBiasInMotion, &state->P);
  SetBlock(kGravity, kTiltInMotion, &state->P);
  state->P(kGravity + 2, kGravity + 2) = kGravityStrength * kGravityStrength;
}

/// At rest only f = b - R^T g is known, and |g|. Along gravity that gives the bias; across it, an
/// error of the bias is one of gravity: dg = R db, fully correlated. Whoever took the two for
/// independent would call the tilt known as soon as the bias is.
void Alignment::CoupleTiltAndBias(const FilterConfig& filter, NavState* state) const {
  const Eigen::Vector3d f = statistics().mean.accel, up_B = f.normalized();
  state->accel_bias = (f.norm() - filter.gravity) * up_B;
  const Eigen::Matrix3d R = state->R_WB.toRotationMatrix();
  const Eigen::Matrix3d along = up_B * up_B.transpose();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along;
  const double b2 = filter.accel_bias_sigma * filter.accel_bias_sigma;
  const double noise2 = filter.accel_noise * filter.accel_noise / config_.duration;
  const double strength2 = kGravityStrength * kGravityStrength;
  state->P.block<3, 3>(kAccelBias, kAccelBias) = b2 * across + (noise2 + strength2) * along;
  state->P.block<3, 3>(kGravity, kGravity) =
      R * ((b2 + noise2) * across + strength2 * along) * R.transpose();
  state->P.block<3, 3>(kGravity, kAccelBias) = b2 * R * across;
  state->P.block<3, 3>(kAccelBias, kGravity) = b2 * across * R.transpose();
}

NavState Alignment::Result(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const {
  NavState state;
  const ImuStatistics s = statistics();
  const Eigen::Vector3d f = s.mean.accel;
  const double roll = std::atan2(f.y(), f.z());
  const double pitch = std::atan2(-f.x(), std::hypot(f.y(), f.z()));
  state.t = s.mean.t;
  state.p = p;
  state.R_WB = math::FromYaw(yaw) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  state.g = {0.0, 0.0, -filter.gravity};
  SetBlock(kP, 1e-3, &state.P);
  SetBlock(kV, AtRest() ? 0.01 : 2.0, &state.P);
  SetBlock(kTheta, AtRest() ? 3e-4 : 0.02, &state.P);
  SetBiases(filter, &state);
  if (AtRest()) Settle(p, yaw, &state);
  return state;
}

/// A body let down on its legs slides and turns a little before it rests: back from the rest, where
/// velocity and biases are known, through all samples to the first one, which has the given heading
/// and position.
void Alignment::Settle(const Eigen::Vector3d& p, double yaw, NavState* state) const {
  Eigen::Quaterniond R = state->R_WB;
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), moved = Eigen::Vector3d::Zero();
  for (size_t i = all_.size() - 1; i > 0; --i) {
    const ImuSample &from = all_[i - 1], &to = all_[i];
    const double dt = to.t - from.t;
    if (dt > kLongestGap) break;
    const Eigen::Vector3d w = 0.5 * (from.gyro + to.gyro) - state->gyro_bias;
    const Eigen::Vector3d force = 0.5 * (from.accel + to.accel) - state->accel_bias;
    const Eigen::Vector3d a = R * math::ExpSO3(-0.5 * dt * w) * force + state->g;
    R = (R * math::ExpSO3(-dt * w)).normalized();
    moved += dt * v - 0.5 * dt * dt * a;
    v -= dt * a;
  }
  const Eigen::Quaterniond turn = math::FromYaw(yaw - math::Yaw(R));
  state->R_WB = (turn * state->R_WB).normalized();
  state->p = p + turn * moved;
}

NavState Alignment::ResultAt(const FilterConfig& filter, const NavState& known) const {
  NavState state = known;
  const Eigen::Vector3d up = known.R_WB * statistics().mean.accel;
  state.g = -filter.gravity * up.normalized();
  SetBiases(filter, &state);
  SetBlock(kGravity, 0.5, &state.P);
  state.P.block<3, 3>(kGravity, kAccelBias).setZero();
  state.P.block<3, 3>(kAccelBias, kGravity).setZero();
  return state;
}

}  // namespace chase::odometry
