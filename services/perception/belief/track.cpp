#include "services/perception/belief/track.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/rotation.h"

namespace chase::perception {

namespace {

constexpr double kHiddenDensity = 0.5;     // m^2/s^3 while not seen: a turn lasts, and adds up
constexpr double kVerticalDensity = 0.02;  // m^2/s^3
constexpr double kFloorSigma = 0.003;      // m, added to every axis of the covariance sent out
constexpr double kRangedFor = 0.5;         // s, some sweeps
constexpr double kTurnDensity = 1.0;  // rad^2/s: a corner taken at 1 rad/s lasts about a second

// Errors that stay alike from frame to frame (Schmidt 1966): of the drone's place, m; of the size
// of what LiDAR never hit wholly, a share of the target's; of a piece's middle, one of its radius.
constexpr double kPlace = 0.005, kOtherSize = 0.6, kPiece = 0.2;
constexpr double kSizeEdges = 2.0;  // deviations of an edge that a size may err by unnoticed
constexpr double kPlaces = 70.0;    // of its size in view, where a first prediction may lie
constexpr double kSure = 0.98;      // probability with which it is taken to drive
constexpr double kAnew = 2.0;       // s that it stood, after which its way is counted anew
constexpr double kBetter = 0.25;    // share of the first variance from which a start is taken anew

double LogDensity(const Eigen::Vector2d& d, const Eigen::Matrix2d& P) {
  return -0.5 * (d.dot(P.inverse() * d) + std::log(P.determinant()));
}

}  // namespace

void Track::Predict(double to, const MotionConfig& config) {
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

void Track::Correct(const Sighting& sighting, const Eigen::Vector3d& camera) {
  const FitResult& fit = sighting.fit;
  const Detection& d = sighting.detection;
  state = fit.posterior;
  shape = fit.shape;
  seen = t;
  if (fit.n_points > 0) ranged = t;
  partial = partial && !fit.whole;
  part = part && (d.part || d.AnyCut());
  misses = 0;
  ++hits;
  last = sighting;
  p_WC = camera;
  sized = sized || d.p_CT || (sighting.SurelyHit() && fit.whole && !d.part && !d.AnyCut());
  odds += (fit.log_odds - odds) / std::max(1, hits - 1);
  driven = driven || Drives();
  const auto spread = [](const Placed& at) { return at.covariance.topLeftCorner<2, 2>().trace(); };
  const bool better = t - first.t > kAnew || spread(Now()) < kBetter * spread(first);
  if (better && LogDrives() < 0.0) first = Now();
}

Track StartTrack(const Sighting& sighting, double t, const Eigen::Vector3d& p_WC) {
  Track track;
  track.t = track.since = t;
  track.partial = true;
  track.part = sighting.detection.part;
  track.Correct(sighting, p_WC);
  track.first = track.Now();
  track.driven = false;
  return track;
}

double Track::HorizontalSigma() const {
  return std::sqrt(state.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
}

/// Where LiDAR does not tell its range, edges do; of a piece the rest may lie on any side.
Placed Track::Now() const {
  Placed now{t, p_WC, state.position(), state.covariance.topLeftCorner<3, 3>()};
  const Detection& d = last.detection;
  const Eigen::Vector3d sight = now.p_WT - p_WC;
  now.edge_share = d.silhouette.sigma_px / std::max(1.0, d.box.height);
  const bool piece = part || partial || d.AnyCut();
  if (piece) now.covariance.diagonal().array() += std::pow(kPiece * shape.size[0], 2);
  if (last.SurelyHit()) return now;
  now.rangeless = piece;
  const double along = piece ? 0.0 : std::sqrt(2.0 / kEdgeWeight) * now.edge_share;
  now.covariance += along * along * sight * sight.transpose();
  return now;
}

/// Its way, as far as it drives at all, has the variance of a new target's speed. If it stands,
/// what errs alike in all frames makes it: edges, the drone's place, and another size, by which it
/// stands nearer or farther than it seems and goes along with the camera.
double Track::LogDrives() const {
  const Placed now = Now();
  const Eigen::Vector2d way = (now.p_WT - first.p_WT).head<2>();
  const Eigen::Vector2d flown = (now.p_WC - first.p_WC).head<2>();
  const double size = sized ? kSizeEdges * now.edge_share : kOtherSize;
  const double speed = kNewSpeed * (now.t - first.t);
  const double edge = first.edge_share * shape.size[1];
  Eigen::Matrix2d P = (first.covariance + now.covariance).topLeftCorner<2, 2>();
  P.diagonal().array() += edge * edge + kPlace * kPlace;
  const Eigen::Vector2d sight = kOtherSize * (now.p_WT - now.p_WC).head<2>();
  if (first.rangeless || now.rangeless) P += sight * sight.transpose();
  return LogDensity(way, P + speed * speed * Eigen::Matrix2d::Identity()) -
         LogDensity(way, P + size * size * flown * flown.transpose());
}

double Track::OddsAgainst() const { return kPlaces * std::exp(-std::min(odds, last.fit.log_odds)); }

bool Track::Alike() const { return 1.0 / (1.0 + OddsAgainst()) > kSure; }

bool Track::Drives() const { return 1.0 / (1.0 + OddsAgainst() + std::exp(-LogDrives())) > kSure; }

Eigen::Matrix3d PublishedCovariance(const Track& track, const PoseSample& pose,
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
