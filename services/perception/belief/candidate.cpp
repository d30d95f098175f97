#include "services/perception/belief/candidate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

// Errors that stay alike from frame to frame (Schmidt 1966): of the drone's place, m, and of the
// size of what LiDAR never hit, a share of the target's.
constexpr double kPlace = 0.01, kOtherSize = 0.6;
constexpr double kPlaces = 70.0;  // of its size in view, where a first prediction may lie
constexpr double kSure = 0.95;    // probability with which it is taken to drive
constexpr int kShownHits = 2;     // sightings before something may hide a side
constexpr double kAstray = 0.1, kAstrayShare = 0.5;  // m and share of its way, off what is told
constexpr double kAnew = 2.0;     // s that it stood, after which its way is counted anew
constexpr double kBetter = 0.25;  // share of the first variance from which a start is taken anew

}  // namespace

Placed Candidate::Now() const {
  const Detection& d = last.detection;
  const double share = 2.0 * d.silhouette.sigma_px / std::max(1.0, d.box.height);
  return {track.t, track.state, p_WC, last.SurelyHit(), share};
}

void Candidate::Correct(const Sighting& sighting, const Eigen::Vector3d& camera) {
  const bool was_partial = track.partial, was_part = part;
  track.Correct(sighting.fit);
  last = sighting;
  p_WC = camera;
  sweeps += sighting.SurelyHit();
  const Detection& d = sighting.detection;
  part = part && (d.part || d.AnyCut());
  const auto spread = [](const TargetGaussian& g) {
    return g.covariance.topLeftCorner<2, 2>().trace();
  };
  // Before, what hid it, or what a small one seemed a piece of, may have seemed its edge.
  const bool out = was_partial && !track.partial && !SurelyDrives(kSureWay);
  const bool alone = was_part && !part && d.box.width < kSharpSigmas * d.silhouette.sigma_px;
  const bool better =
      track.t - first.t > kAnew || spread(track.state) <= kBetter * spread(first.state);
  if (out || alone || (better && LogDrives() < 0.0)) first = Now();
}

Candidate NewCandidate(const Sighting& sighting, const View& view) {
  Candidate c;
  c.track = StartTrack(sighting.fit, view.t);
  c.since = view.t;
  c.last = sighting;
  c.p_WC = view.camera.p_WC;
  c.first = c.Now();
  c.edge = sighting.detection.silhouette.sigma_px * c.Range() / view.camera.rig.focal_px;
  c.part = sighting.detection.part;
  c.sweeps = sighting.SurelyHit();
  return c;
}

bool Candidate::HiddenIn(const Sighting& s) const {
  return first.ranged && !part && track.hits >= kShownHits && s.SurelyHit() &&
         !s.detection.AnyCut() && s.LeftOut() == 1;
}

bool Candidate::Steady() const {
  const Eigen::Vector2d told = (track.t - first.t) * track.state.velocity().head<2>();
  return (Way() - told).norm() < kAstray + kAstrayShare * Way().norm();
}

bool Candidate::SurelyDrives(double way) const {
  Eigen::Vector2d d = Way();
  const Eigen::Vector2d n = (track.state.position() - p_WC).head<2>().normalized();
  if (!first.ranged || !last.SurelyHit()) d -= n.dot(d) * n;  // what shows of it may grow
  return Drives() && Steady() && d.norm() > way;
}

/// Its way, as far as it drives at all, has the variance of a new target's speed. If it stands,
/// what errs alike in all frames makes it: edges, which tell its range where LiDAR does not, and
/// another size, by which it stands nearer or farther than it seems and goes along with the camera.
double Candidate::LogDrives() const {
  const auto log_density = [](const Eigen::Vector2d& d, const Eigen::Matrix2d& P) {
    return -0.5 * (d.dot(P.inverse() * d) + std::log(P.determinant()));
  };
  const Placed now = Now();
  const bool sized = sweeps > 0 || last.detection.p_CT;
  const Eigen::Vector2d flown = (now.p_WC - first.p_WC).head<2>();
  const double size = sized ? now.edge_share : kOtherSize, speed = kNewSpeed * (now.t - first.t);
  Eigen::Matrix2d P = (edge * edge + kPlace * kPlace) * Eigen::Matrix2d::Identity();
  for (const Placed& end : {first, now}) {
    const double share = end.ranged ? 0.0 : end.edge_share;
    const Eigen::Vector2d off = share * (end.state.position() - end.p_WC).head<2>();
    P += end.state.covariance.topLeftCorner<2, 2>() + off * off.transpose();
  }
  return log_density(Way(), P + speed * speed * Eigen::Matrix2d::Identity()) -
         log_density(Way(), P + size * size * flown * flown.transpose());
}

double Candidate::Probability() const {
  return 1.0 / (1.0 + kPlaces * std::exp(-last.fit.log_odds) + std::exp(-LogDrives()));
}

bool Candidate::Drives() const { return Probability() > kSure; }

}  // namespace chase::perception
