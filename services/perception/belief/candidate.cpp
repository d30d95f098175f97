#include "services/perception/belief/candidate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

// Errors that stay alike from frame to frame (Schmidt 1966): of the drone's place, m, and of the
// size of what LiDAR never hit wholly, a share of the target's.
constexpr double kPlace = 0.005, kOtherSize = 0.6;
constexpr double kSizeEdges = 2.0;  // deviations of an edge that a size may err by unnoticed
constexpr double kPlaces = 70.0;    // of its size in view, where a first prediction may lie
constexpr double kSure = 0.98;      // probability with which it is taken to drive
constexpr double kAstray = 0.1, kAstrayShare = 0.5;  // m and share of its way, off what is told
constexpr double kAnew = 2.0;     // s that it stood, after which its way is counted anew
constexpr double kBetter = 0.25;  // share of the first variance from which a start is taken anew

}  // namespace

Placed Candidate::Now() const {
  Placed now{track.t, p_WC, track.state.position(), track.state.covariance.topLeftCorner<3, 3>()};
  now.ranged = last.SurelyHit();
  const Detection& d = last.detection;
  now.edge_share = d.silhouette.sigma_px / std::max(1.0, d.box.height);
  if (now.ranged) return now;
  const Eigen::Vector3d off = std::sqrt(2.0 / kEdgeWeight) * now.edge_share * (now.p_WT - p_WC);
  now.covariance += off * off.transpose();
  return now;
}

void Candidate::Correct(const Sighting& sighting, const Eigen::Vector3d& camera) {
  const bool was_partial = track.partial, was_part = part;
  track.Correct(sighting.fit);
  last = sighting;
  p_WC = camera;
  const Detection& d = sighting.detection;
  sweeps += sighting.SurelyHit() && sighting.fit.whole && !d.AnyCut();
  odds += (sighting.fit.log_odds - odds) / std::max(1, track.hits - 1);
  part = part && (d.part || d.AnyCut());
  const auto spread = [](const Placed& at) { return at.covariance.topLeftCorner<2, 2>().trace(); };
  // Before, what hid it, or what a small one seemed a piece of, may have seemed its edge.
  const bool out = was_partial && !track.partial && !SurelyDrives(kSureWay);
  const bool alone = was_part && !part && d.box.width < kSharpSigmas * d.silhouette.sigma_px;
  const bool better = track.t - first.t > kAnew || spread(Now()) < kBetter * spread(first);
  if (out || alone || (better && LogDrives() < 0.0)) first = Now();
}

Candidate NewCandidate(const Sighting& sighting, const View& view) {
  Candidate c;
  c.track = StartTrack(sighting.fit, view.t);
  c.since = view.t;
  c.last = sighting;
  c.p_WC = view.camera.p_WC;
  c.first = c.Now();
  c.edge = sighting.detection.silhouette.sigma_px / std::sqrt(kEdgeWeight) * c.Range() /
           view.camera.rig.focal_px;
  c.part = sighting.detection.part;
  c.sweeps = sighting.Clear();
  return c;
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
  const double size = sized ? kSizeEdges * now.edge_share : kOtherSize,
               speed = kNewSpeed * (now.t - first.t);
  Eigen::Matrix2d P = (first.covariance + now.covariance).topLeftCorner<2, 2>();
  P.diagonal().array() += edge * edge + kPlace * kPlace;
  return log_density(Way(), P + speed * speed * Eigen::Matrix2d::Identity()) -
         log_density(Way(), P + size * size * flown * flown.transpose());
}

double Candidate::OddsAgainst() const {
  return kPlaces * std::exp(-std::min(odds, last.fit.log_odds));
}

bool Candidate::Alike() const { return 1.0 / (1.0 + OddsAgainst()) > kSure; }

double Candidate::Probability() const {
  return 1.0 / (1.0 + OddsAgainst() + std::exp(-LogDrives()));
}

bool Candidate::Drives() const { return Probability() > kSure; }

}  // namespace chase::perception
