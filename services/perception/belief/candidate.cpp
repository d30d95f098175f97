#include "services/perception/belief/candidate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kMoved = 0.04, kMovedEdges = 5.0;  // m and sigmas that an edge may seem to move
constexpr double kMovedUnclear = 0.06, kMovedUnclearEdges = 8.0;  // where something may hide it
constexpr double kMovedAcross = 0.03, kMovedAcrossEdges = 4.0;    // where all of it is seen sharply
constexpr double kMovedGate = 11.8;   // squared distance, 2 dof, that chance does not reach
constexpr double kSlow = 0.1;         // m/s, what is slower stands, as far as errors go
constexpr double kFast = 0.3;         // m/s that LiDAR points of two sweeps tell from standing,
constexpr double kFastGate = 30.0;    // and its squared distance from it, 2 dof
constexpr int kShownHits = 2;         // sightings before something may hide a side
constexpr double kFastAge = 0.08;     // s since the last such points, at most
constexpr double kKnownSigmas = 1.5;  // from which a way along the line of sight counts
constexpr double kAstray = 0.1, kAstrayShare = 0.5;  // m and share of its way, off what is told
constexpr double kAnew = 2.0;     // s that it stood, after which its way is counted anew
constexpr double kBetter = 0.25;  // share of the first variance from which a start is taken anew

}  // namespace

void Candidate::Correct(const Sighting& sighting) {
  const bool was_partial = track.partial, was_part = part;
  track.Correct(sighting.fit);
  last = sighting;
  sweeps += sighting.fit.n_points > 0;
  const Detection& d = sighting.detection;
  part = part && (d.part || d.AnyCut());
  const auto spread = [](const TargetGaussian& g) {
    return g.covariance.topLeftCorner<2, 2>().trace();
  };
  // Before, what hid it, or what a small one seemed a piece of, may have seemed its edge.
  const bool out = was_partial && !track.partial && !SurelyDrives(kSureWay);
  const bool alone = was_part && !part && d.box.width < kSharpSigmas * d.silhouette.sigma_px;
  const bool stands = !Drives() && track.t - known > kAnew;
  if (!out && !alone && !stands && (Drives() || spread(track.state) > kBetter * spread(first)))
    return;
  first = track.state;
  ranged = sighting.fit.n_points > 0;
  known = track.t;
}

Candidate NewCandidate(const Sighting& sighting, const View& view) {
  Candidate c;
  c.track = StartTrack(sighting.fit, view.t);
  c.first = sighting.fit.posterior;
  c.since = c.known = view.t;
  c.last = sighting;
  c.ranged = sighting.fit.n_points > 0;
  const Eigen::Vector3d sight = c.track.state.position() - view.camera.p_WC;
  c.range = sight.norm();
  const double sigma_px = sighting.detection.silhouette.sigma_px;
  c.edge = sigma_px * c.range / view.camera.rig.focal_px;
  c.range_error = 2.0 * sigma_px * sight.head<2>() / sighting.detection.box.height;
  c.part = sighting.detection.part;
  c.sweeps = c.ranged;
  return c;
}

bool Candidate::HiddenIn(const Sighting& s) const {
  return ranged && !part && track.hits >= kShownHits && s.SurelyHit() && !s.detection.AnyCut() &&
         s.LeftOut() == 1;
}

bool Candidate::Fast() const {
  if (track.t - track.ranged > kFastAge) return false;
  const Eigen::Vector2d v = track.state.velocity().head<2>();
  return v.norm() > kFast &&
         v.dot(track.state.covariance.block<2, 2>(3, 3).ldlt().solve(v)) > kFastGate;
}

bool Candidate::Steady() const {
  const Eigen::Vector2d way = (track.state.position() - first.position()).head<2>();
  const Eigen::Vector2d told = (track.t - known) * track.state.velocity().head<2>();
  return (way - told).norm() < kAstray + kAstrayShare * way.norm();
}

bool Candidate::SurelyDrives(double way) const {
  Eigen::Vector2d d = (track.state.position() - first.position()).head<2>();
  const Eigen::Vector2d n = range_error.normalized();
  if (!ranged || last.fit.n_points == 0) d -= n.dot(d) * n;  // what shows of it may grow
  return Drives() && Steady() && d.norm() > way;
}

bool Candidate::Drives() const {
  // A side that was never seen, and is not now, does not seem to move it.
  const bool clear = !last.detection.AnyCut() && (last.fit.whole || track.partial);
  // Taken from its size, its range may be wrong, and so may be its speed; one sweep tells none.
  const bool told = ranged && last.fit.n_points > 0 && track.t > known;
  if (clear && told && Fast()) return true;
  Eigen::Vector2d d = (track.state.position() - first.position()).head<2>();
  Eigen::Matrix2d P =
      track.state.covariance.topLeftCorner<2, 2>() + first.covariance.topLeftCorner<2, 2>();
  if (!ranged) P += range_error * range_error.transpose();  // edges err alike from frame to frame
  if (d.dot(P.ldlt().solve(d)) < kMovedGate || d.norm() < kSlow * (track.t - known)) return false;
  const Eigen::Vector2d n = range_error.normalized();
  const double along = n.dot(d), sigma = std::sqrt(n.dot(P * n));
  if (clear && last.detection.box.width > kSharpSigmas * last.detection.silhouette.sigma_px &&
      (d - along * n).norm() > std::max(kMovedAcross, kMovedAcrossEdges * edge))
    return true;
  if (std::abs(along) < kKnownSigmas * sigma) d -= along * n;  // may be no way at all
  return d.norm() > (ranged && clear ? std::max(kMoved, kMovedEdges * edge)
                                     : std::max(kMovedUnclear, kMovedUnclearEdges * edge));
}

}  // namespace chase::perception
