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
constexpr double kSpeedInMotion = 2.0;      // m/s
constexpr double kGyroBiasInMotion = 0.05;  // rad/s
constexpr double kKnownPlace = 1e-3;        // m
constexpr double kKnownTheta = 3e-4;        // rad
constexpr double kSpeedAtRest = 0.01;       // m/s
constexpr double kLongestGap = 0.03;        // s between samples over which a motion is followed

void SetBlock(int block, double sigma, ErrorCovariance* P) {
  P->block<3, 3>(block, block) = sigma * sigma * Eigen::Matrix3d::Identity();
}

/// Gravity may lie anywhere near where the mean force says; its strength is known.
void OpenInMotion(ErrorCovariance* P) {
  SetBlock(kGyroBias, kGyroBiasInMotion, P);
  SetBlock(kGravity, kTiltInMotion, P);
  (*P)(kGravity + 2, kGravity + 2) = kGravityStrength * kGravityStrength;
}

/// Attitude of heading `yaw` in which the specific force `f` points up.
Eigen::Quaterniond Upright(const Eigen::Vector3d& f, double yaw) {
  const double roll = std::atan2(f.y(), f.z());
  const double pitch = std::atan2(-f.x(), std::hypot(f.y(), f.z()));
  return math::FromYaw(yaw) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

double Spread(const Eigen::Vector3d& squares, const Eigen::Vector3d& mean, double n) {
  return std::sqrt((squares / n - mean.cwiseAbs2()).cwiseMax(0.0).maxCoeff());
}

}  // namespace

void Alignment::Add(const ImuSample& imu) {
  if (window_.empty()) first_t_ = imu.t;
  if (!all_.empty() && imu.t - all_.back().t > kLongestGap) all_.clear();
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
  SetBlock(kMount, filter.mount_sigma, &state->P);
  SetBlock(kAccelBias, filter.accel_bias_sigma, &state->P);
  if (AtRest()) {
    SetBlock(kGyroBias, filter.gyro_bias_sigma, &state->P);
    state->gyro_bias = statistics().mean.gyro;
    return CoupleTiltAndBias(filter, state);
  }
  OpenInMotion(&state->P);
}

/// At rest only f = b - (R Exp(mount))^T g is known, and |g|. Along gravity that gives the bias;
/// across it, an error of the bias or the mounting is one of gravity: dg = R db + R Hat(f) dmount,
/// fully correlated. Whoever took them for independent would call the tilt known as soon as they
/// are.
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
  const Eigen::Matrix3d mount = filter.mount_sigma * math::Hat(f);
  state->P.block<3, 3>(kGravity, kGravity) =
      R * ((b2 + noise2) * across + strength2 * along + mount * mount.transpose()) * R.transpose();
  state->P.block<3, 3>(kGravity, kAccelBias) = b2 * R * across;
  state->P.block<3, 3>(kAccelBias, kGravity) = b2 * across * R.transpose();
  state->P.block<3, 3>(kGravity, kMount) = filter.mount_sigma * R * mount;
  state->P.block<3, 3>(kMount, kGravity) = filter.mount_sigma * mount.transpose() * R.transpose();
}

NavState Alignment::Result(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const {
  NavState state;
  const ImuStatistics s = statistics();
  state.t = s.mean.t;
  state.R_WB = Upright(s.mean.accel, yaw);
  state.g = {0.0, 0.0, -filter.gravity};
  SetBlock(kP, kKnownPlace, &state.P);
  SetBlock(kV, kSpeedAtRest, &state.P);
  SetBlock(kTheta, kKnownTheta, &state.P);
  SetBiases(filter, &state);
  // A body let down on its legs slides and turns a little before it rests.
  const NavState first = AtFirst(filter, state);
  const Eigen::Quaterniond turn = math::FromYaw(yaw - math::Yaw(first.R_WB));
  state.R_WB = (turn * state.R_WB).normalized();
  state.p = p + turn * (state.p - first.p);
  return state;
}

NavState Alignment::InMotion(const FilterConfig& filter, const Eigen::Vector3d& p,
                             double yaw) const {
  Eigen::Quaterniond R =
      Eigen::Quaterniond::Identity();  // from a sample's frame to the first one's
  Eigen::Vector3d force = all_.front().accel;
  for (size_t i = 1; i < all_.size(); ++i) {
    const double dt = all_[i].t - all_[i - 1].t;
    R = (R * math::ExpSO3(0.5 * dt * (all_[i - 1].gyro + all_[i].gyro))).normalized();
    force += R * all_[i].accel;
  }
  NavState state;
  state.t = all_.front().t;
  state.R_WB = Upright(force, yaw);
  return Opened(filter, p, yaw, state);
}

NavState Alignment::InMotion(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw,
                             const NavState& first) const {
  return Opened(filter, p, yaw, first);
}

/// The same state with the given place, upright, and all but the place open.
NavState Alignment::Opened(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw,
                           NavState state) const {
  const auto upright = Eigen::Quaterniond::FromTwoVectors(state.g, -Eigen::Vector3d::UnitZ());
  const Eigen::Quaterniond turn = math::FromYaw(yaw - math::Yaw(upright * state.R_WB)) * upright;
  state.R_WB = (turn * state.R_WB).normalized();
  state.v = turn * state.v;
  state.p = p;
  state.g = {0.0, 0.0, -filter.gravity};
  state.accel_bias.setZero(), state.gyro_bias.setZero();  // what they may be is said about nought
  state.P.setZero();
  SetBlock(kP, kKnownPlace, &state.P);
  SetBlock(kV, kSpeedInMotion, &state.P);
  SetBlock(kTheta, kKnownTheta, &state.P);
  SetBlock(kAccelBias, filter.accel_bias_sigma, &state.P);
  SetBlock(kMount, filter.mount_sigma, &state.P);
  OpenInMotion(&state.P);
  return state;
}

NavState Alignment::AtFirst(const FilterConfig& filter, NavState state) const {
  for (size_t i = all_.size() - 1; i > 0; --i) {
    const ImuSample &from = all_[i - 1], &to = all_[i];
    Propagate(filter, {from.t, 0.5 * (from.accel + to.accel), 0.5 * (from.gyro + to.gyro)}, &state);
  }
  return state;
}

NavState Alignment::ResultAt(const FilterConfig& filter, const NavState& known) const {
  NavState state = known;
  const Eigen::Vector3d up = known.R_WB * statistics().mean.accel;
  state.g = -filter.gravity * up.normalized();
  SetBiases(filter, &state);
  SetBlock(kGravity, 0.5, &state.P);
  for (const int block : {kAccelBias, kMount}) {
    state.P.block<3, 3>(kGravity, block).setZero();
    state.P.block<3, 3>(block, kGravity).setZero();
  }
  return state;
}

}  // namespace chase::odometry
