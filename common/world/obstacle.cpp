#include "common/world/obstacle.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace chase::world {

double SegmentSquaredDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                              const Eigen::Vector3d& c, const Eigen::Matrix3d& R) {
  const Eigen::Vector3d u = q - p;
  const double uu = u.dot(R * u);
  const double s = uu > 0.0 ? std::clamp((c - p).dot(R * u) / uu, 0.0, 1.0) : 0.0;
  const Eigen::Vector3d d = p + s * u - c;
  return d.dot(R * d);
}

Inflation::Inflation(const Eigen::Matrix3d& R)
    : aligned_(R(0, 1) == 0.0 && R(0, 2) == 0.0 && R(1, 2) == 0.0) {
  if (aligned_) {
    radius_ = R.diagonal().array().sqrt().inverse();
    return;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(R);
  axes_ = eigen.eigenvectors();
  radius_ = eigen.eigenvalues().array().sqrt().inverse();
}

Eigen::Matrix3d Inflation::By(double margin) const {
  const Eigen::Vector3d inverse = (radius_ + margin).square().inverse();
  if (aligned_) return inverse.asDiagonal();
  return axes_ * inverse.asDiagonal() * axes_.transpose();
}

Eigen::Matrix3d Inflated(const Eigen::Matrix3d& R, double margin) {
  return Inflation(R).By(margin);
}

}  // namespace chase::world
