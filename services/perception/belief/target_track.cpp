#include "services/perception/belief/target_track.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/rotation.h"

namespace chase::perception {

namespace {

constexpr int kProvenHits = 20;
constexpr double kHiddenDensity = 0.5;     // m^2/s^3 while not seen: a turn lasts, and adds up
constexpr double kVerticalDensity = 0.02;  // m^2/s^3
constexpr double kFloorSigma = 0.003;      // m, added to every axis of the covariance sent out
constexpr double kRangedFor = 0.5;         // s, some sweeps
constexpr double kTurnDensity = 1.0;  // rad^2/s: a corner taken at 1 rad/s lasts about a second

}  // namespace

void TargetTrack::Predict(double to, const MotionConfig& config) {
  const double dt = to - t;
  if (!(dt > 0.0)) return;
  Matrix6d F = Matrix6d::Identity();
  F.topRightCorner<3, 3>() = dt * Eigen::Matrix3d::Identity();
  if (misses > 0) F.bottomRightCorner<3, 3>() *= std::exp(-dt / kHiddenTime);
  const double density = misses > 0 ? kHiddenDensity : config.acceleration_density;
  const Eigen::Vector3d q(density, density, kVerticalDensity);
  Matrix6d Q = Matrix6d::Zero();
  Q.topLeftCorner<3, 3>() = (q * dt * dt * dt / 3.0).asDiagonal();
  Q.topRightCorner<3, 3>() = (q * dt * dt / 2.0).asDiagonal();
  Q.bottomLeftCorner<3, 3>() = Q.topRightCorner<3, 3>();
  Q.bottomRightCorner<3, 3>() = (q * dt).asDiagonal();
  if (misses > 0) state.mean[5] = 0.0;  // slopes end, and what was measured of one may be noise
  state.mean = F * state.mean;
  state.covariance = F * state.covariance * F.transpose() + Q;
  shape.yaw_variance = std::min(TargetShape::kAnyYaw, shape.yaw_variance + kTurnDensity * dt);
  t = to;
  const double most = kGroundSigma * kGroundSigma;  // it stays on the ground
  if (misses == 0 || state.covariance(2, 2) < most) return;
  const double share = std::sqrt(most / state.covariance(2, 2));
  state.covariance.row(2) *= share;
  state.covariance.col(2) *= share;
}

void TargetTrack::Correct(const FitResult& fit) {
  state = fit.posterior;
  shape = fit.shape;
  seen = t;
  if (fit.n_points > 0) ranged = t;
  joined = fit.joined;
  partial = partial && !fit.whole;
  misses = 0;
  ++hits;
}

TargetTrack StartTrack(const FitResult& fit, double t) {
  TargetTrack track;
  track.t = t;
  track.partial = true;
  track.Correct(fit);
  return track;
}

bool TargetTrack::Proven() const { return hits >= kProvenHits; }

double TargetTrack::HorizontalSigma() const {
  return std::sqrt(state.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
}

Eigen::Matrix3d PublishedCovariance(const TargetTrack& track, const PoseSample& pose,
                                    double outline_sigma, const MotionConfig& config) {
  const double tilt = config.tilt_sigma_deg * M_PI / 180.0;
  const double heading = config.heading_sigma_deg * M_PI / 180.0;
  Eigen::Matrix<double, 6, 6> C = pose.covariance;
  for (int i = 0; i < 3; ++i) {
    C(i, i) = std::max(C(i, i), config.pose_sigma * config.pose_sigma);
    const double angle = i < 2 ? tilt : heading;
    C(i + 3, i + 3) = std::max(C(i + 3, i + 3), angle * angle);
  }
  // p_WT = p_WB + R_WB p_BT: a small rotation dr of the body in W moves it by dr x (p_WT - p_WB).
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -math::Hat(track.state.position() - pose.p_WB);
  const double floor = kFloorSigma * kFloorSigma;
  // What is not shaped as the model seems nearer or farther, alike in every frame without points.
  const double share = track.t - track.ranged > kRangedFor ? outline_sigma : 0.0;
  const Eigen::Vector3d off = share * (track.state.position() - pose.p_WB);
  const Eigen::Matrix3d P = track.state.covariance.topLeftCorner<3, 3>() + J * C * J.transpose() +
                            off * off.transpose() + floor * Eigen::Matrix3d::Identity();
  return math::MadePositiveDefinite(P, floor);
}

}  // namespace chase::perception
