#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::math {

/// A normal distribution over positions; covariance symmetric positive definite.
struct Gaussian3 {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// (x - mean)' covariance^-1 (x - mean); infinity when the covariance is not positive definite.
double SquaredMahalanobis(const Gaussian3& g, const Eigen::Vector3d& x);

/// Logarithm of the density at x; -infinity when the covariance is not positive definite.
double LogDensity(const Gaussian3& g, const Eigen::Vector3d& x);

/// `count` points of the horizontal contour at `sigmas` standard deviations around the mean; the
/// first is the mean itself. Jeon 2021, section III-A. Evenly spread in the whitened x-y plane.
std::vector<Eigen::Vector3d> ContourPoints(const Gaussian3& g, double sigmas, int count);

/// Standard deviation along the worst direction of a symmetric matrix; 0 where none is positive.
double LargestSigma(const Eigen::Matrix3d& covariance);

/// Is m symmetric and positive semidefinite, up to rounding?
bool IsCovariance(const Eigen::Matrix3d& m);

/// The nearest symmetric matrix whose eigenvalues are at least `floor` (> 0).
Eigen::Matrix3d MadePositiveDefinite(const Eigen::Matrix3d& m, double floor);

}  // namespace chase::math
