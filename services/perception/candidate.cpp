#include "services/perception/candidate.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace chase::perception {

namespace {

constexpr double kMoved = 0.06;      // m,
constexpr double kMovedPx = 4.0;     // that an edge may seem to move where something hides it, and
constexpr double kMovedGate = 11.8;  // squared distance, 2 dof, that chance does not reach
constexpr double kBetter = 0.25;     // share of the first variance from which a start is taken anew

}  // namespace

void Candidate::Correct(const Sighting& sighting) {
  track.Correct(sighting.fit);
  last = sighting;
  const auto spread = [](const TargetGaussian& g) {
    return g.covariance.topLeftCorner<2, 2>().trace();
  };
  if (!Drives() && spread(track.state) < kBetter * spread(first)) first = track.state;
}

bool Candidate::Drives() const {
  const Eigen::Vector2d d = (track.state.position() - first.position()).head<2>();
  const Eigen::Matrix2d P =
      track.state.covariance.topLeftCorner<2, 2>() + first.covariance.topLeftCorner<2, 2>();
  return d.norm() > std::max(kMoved, kMovedPx * px) && d.dot(P.ldlt().solve(d)) > kMovedGate;
}

}  // namespace chase::perception
