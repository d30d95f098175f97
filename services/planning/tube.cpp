#include "services/planning/tube.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/math/gaussian.h"
#include "common/world/ages.h"
#include "services/planning/resting.h"

namespace chase::planning {
namespace {

// Static obstacles seem to move when the frame drifts. What the tube has to spare for that, m, over
// `duration`, s, holds deviations of the velocity up to `held`. The rest is added to the obstacles'
// covariance: n' C n <= held^2 + n' rest n for each direction n.
Eigen::Matrix3d BeyondTube(const Eigen::Matrix3d& covariance, double spare, double duration,
                           double sigmas) {
  if (!covariance.allFinite() || !(sigmas > 0.0)) return Eigen::Matrix3d::Zero();
  const double held = spare / (sigmas * duration);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const Eigen::Vector3d rest = (eigen.eigenvalues().array() - held * held).max(0.0);
  return eigen.eigenvectors() * rest.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

Tube MakeTube(const PlanningConfig& config, const BodyEstimate& body, double bound, bool chased) {
  const double sigmas = config.planner.sigmas, least = config.planner.tracking_tube;
  const bool known = body.position_covariance.allFinite() && body.velocity_covariance.allFinite();
  const double strays =
      known ? bound + sigmas * math::LargestSigma(body.position_covariance) : kWidestTube;
  const double radius = std::clamp(strays, least, std::max(least, kWidestTube));
  const double spare = chased ? std::max(0.0, radius - strays) : 0.0;
  const double duration =
      world::kMostAge.obstacles + config.latency + config.horizon + kLongestBrake;
  return {radius, std::max(0.0, strays - radius),
          BeyondTube(body.velocity_covariance, spare, duration, sigmas)};
}

}  // namespace chase::planning
