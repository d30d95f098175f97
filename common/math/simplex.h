#pragma once

#include <Eigen/Core>

namespace chase::math {

/// Up to four points in general position and the point of their convex hull that lies nearest to
/// the origin, kept up to date while points are added (Wolfe 1976, "Finding the nearest point in a
/// polytope"; with support points of a convex set this is the algorithm of Gilbert, Johnson and
/// Keerthi 1988).
class Simplex {
 public:
  /// False, and nothing changed, where the point adds nothing: it lies (nearly) in the affine hull
  /// of the others. Points that the nearest one does not need are dropped.
  bool Add(const Eigen::Vector3d& point);

  /// Of the hull; only after Add.
  const Eigen::Vector3d& nearest() const { return nearest_; }
  int size() const { return size_; }

 private:
  /// Weights, of sum 1, of the point of the affine hull that lies nearest to the origin.
  bool AffineWeights(double* weights) const;
  bool Reduce();

  int size_ = 0;
  Eigen::Matrix<double, 3, 4> points_;
  Eigen::Vector4d weights_ = Eigen::Vector4d::Zero();
  Eigen::Vector3d nearest_ = Eigen::Vector3d::Zero();
};

}  // namespace chase::math
