#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "services/perception/perception_config.h"
#include "services/perception/sensors/camera.h"
#include "services/perception/sensors/point_selector.h"
#include "services/perception/sight/detector.h"

namespace chase::perception {

inline constexpr double kNearest = 0.2;  ///< m, of ranges that scale pixels
/// Independent samples that one edge, and at most those that one sweep's points, count for.
inline constexpr double kEdgeWeight = 3.0, kLidarWeight = 16.0;

/// Standard deviations of a new target's speed, horizontal and vertical, m/s.
inline constexpr double kNewSpeed = 1.2, kNewClimb = 0.1;

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Gaussian of the target's position p_WT [m] and velocity v_WT [m/s], frame W, at one time.
struct TargetGaussian {
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Identity();

  Eigen::Vector3d position() const { return mean.head<3>(); }
  Eigen::Vector3d velocity() const { return mean.tail<3>(); }
  /// Leaves nothing known of the velocity.
  void ForgetVelocity() {
    mean.tail<3>().setZero();
    covariance.topRightCorner<3, 3>().setZero();
    covariance.bottomLeftCorner<3, 3>().setZero();
    covariance.bottomRightCorner<3, 3>() =
        Eigen::Vector3d(kNewSpeed, kNewSpeed, kNewClimb).cwiseAbs2().asDiagonal();
  }
};

/// All that is known for one frame. The time of the frame is that of `prior`.
struct FitInput {
  TargetGaussian prior;
  TargetShape shape;
  Camera camera;
  const Detection* detection = nullptr;
  std::array<bool, 4> use_side = {true, true, true, true};  ///< by Side
  std::vector<TargetPoint> points;
  const Clusters* hits = nullptr;  ///< all points on the detection, the target's or not; or null
  bool reappears = false;          ///< all or part of it was hidden before, and part may still be
};

struct FitResult {
  bool ok = false;  ///< solved, finite, covariance found
  TargetGaussian posterior;
  TargetShape shape;
  std::array<double, 4> edge_px = {};  ///< by Side: median residual, px, positive: seen outside fit
  std::array<bool, 4> used = {};       ///< by Side
  bool whole = true;                   ///< no side that the detection shows is left out
  bool joined = false;                 ///< a like colour goes on beyond a side
  int n_points = 0;                    ///< LiDAR points in the fit
  double point_rms = 0.0;              ///< distance of the points from the surface, m
  double prior_distance = 0.0;         ///< squared Mahalanobis distance from the prior
  double cost = 0.0;                   ///< half the robust sum of squares, prior included
  /// Logarithm of the prediction's density of these measurements, but for what the measurements'
  /// own densities add: Laplace's approximation around the solution. What a position measured by
  /// the detector costs is left out too, since it may be a stray one: LogTarget() adds it.
  double log_evidence = 0.0;
  double log_odds = 0.0;  ///< of being the target rather than anything else of its colour
};

/// When the solver ends: iterations, and change of the cost, as a share.
struct Effort {
  int iterations = 8;
  double tolerance = 1e-5;
};

/// The most likely position and velocity of the target (of a box its heading, too) from silhouette,
/// LiDAR points, each at its own time, and prediction, with the covariance: one step of an iterated
/// extended Kalman filter, by Ceres' TinySolver from the prediction on.
FitResult FitTarget(const FitInput& input, const FitConfig& config, const Effort& effort = {});

}  // namespace chase::perception
