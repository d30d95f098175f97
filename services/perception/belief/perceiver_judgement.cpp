#include <algorithm>
#include <cmath>

#include "services/perception/belief/perceiver.h"

// What the Perceiver takes for its target.

namespace chase::perception {

namespace {

constexpr double kStandingRange = 10.0;  // m, what stands further off is not taken
constexpr double kGateSigmas = 3.0;
constexpr double kReachMargin = 0.5;   // m
constexpr double kReachGate = 11.3;    // squared distance from a hidden target's prediction, 3 dof
constexpr double kExpectedGate = 4.6;  // likewise of what need not drive, 2 dof
constexpr int kPieceHits = 4;          // sightings of a piece or a half before it is taken,
constexpr int kPieceSweeps = 2;        // of them with LiDAR points, for what has come out wholly,
constexpr int kNewPieceHits = 10;      // and where none was ever seen, nor LiDAR tells much
constexpr double kNewPieceWay = 0.3;   // m, likewise
constexpr double kMemory = 60.0;       // s that a look-alike is remembered
constexpr double kFar = 5.0;           // m, from where fewer pixels tell what stands there

}  // namespace

/// True where a look-alike is remembered.
bool Perceiver::IsLookAlike(const Eigen::Vector3d& p_W, double t) const {
  return std::any_of(look_alikes_.begin(), look_alikes_.end(), [&](const LookAlike& other) {
    return t - other.t < kMemory && (other.p_W - p_W).norm() < config_.state.decoy_radius;
  });
}

bool Perceiver::InGate(const Sighting& s, double t) const {
  const Eigen::Vector3d p_WT = s.fit.posterior.position();
  if (IsLookAlike(p_WT, t)) return false;
  if (!track_ || tentative_ || !track_->Proven()) return true;
  if (state_ != TargetState::kLost) {
    const Eigen::Vector3d d = p_WT - track_->state.position();
    if (std::abs(d.z()) >= kGateSigmas * kGroundSigma) return false;
    const Eigen::Matrix3d P = track_->state.covariance.topLeftCorner<3, 3>();
    return d.dot(P.ldlt().solve(d)) < kReachGate;
  }
  const double way = (p_WT - last_p_).norm(), unseen = t - track_->seen;
  return way < kReachMargin + config_.motion.max_speed * unseen;
}

/// True for a sighting after which nothing need be asked: close to where the target was expected.
bool Perceiver::Sure(const Sighting& s) const {
  if (track_->misses == 0) return true;
  const Eigen::Vector2d off = (s.fit.posterior.position() - track_->state.position()).head<2>();
  const Eigen::Matrix2d P = track_->state.covariance.topLeftCorner<2, 2>();
  return off.norm() < config_.state.decoy_radius || off.dot(P.ldlt().solve(off)) < kExpectedGate;
}

/// Of a piece of something larger, or what is hidden or cut off in part, once it has driven further
/// than what shows of it may seem to, or has come out wholly and LiDAR tells that it drives.
bool Perceiver::PieceIsReady(const Candidate& c) const {
  const bool hasty = !track_ && (c.last.detection.LeavesImage() || !c.last.SurelyHit());
  if (c.track.hits < (hasty ? kNewPieceHits : kPieceHits)) return false;
  const bool came_out = !hasty && c.last.AllSeen() && c.sweeps >= kPieceSweeps && c.Drives();
  return came_out || c.SurelyDrives(hasty ? kNewPieceWay : Candidate::kSureWay);
}

/// Of what stands: after a while. A target that was seen must have had the time to stop.
bool Perceiver::StandsLongEnough(const Candidate& c, double t) const {
  const bool may_stand = !c.last.detection.AnyCut() && (!track_ || t - track_->seen > kHiddenTime);
  const double wait = config_.state.standing_after * std::max(1.0, std::pow(c.Range() / kFar, 2));
  return may_stand && c.Range() < kStandingRange && t - c.since >= wait;
}

/// What drives is taken at once.
bool Perceiver::Ready(const Candidate& c, double t) const {
  if (c.track.misses > 0 || c.track.hits < Candidate::kConfirmFrames) return false;
  const Detection& d = c.last.detection;
  const bool unclear = d.AnyCut() && !c.last.SurelyHit();
  const bool piece = c.part || c.track.partial || d.LeavesImage() || unclear;
  if (piece ? PieceIsReady(c) : c.Drives()) return true;
  const bool hidden = c.track.partial && !c.part && !d.LeavesImage() && c.last.SurelyHit();
  return (!piece || (hidden && c.Alike())) && !sighting_ && StandsLongEnough(c, t);
}

}  // namespace chase::perception
