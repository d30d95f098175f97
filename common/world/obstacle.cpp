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

Eigen::Matrix3d Inflated(const Eigen::Matrix3d& R, double margin) {
  if (R(0, 1) == 0.0 && R(0, 2) == 0.0 && R(1, 2) == 0.0) {  // the axes are those of the frame
    const Eigen::Array3d radius = R.diagonal().array().sqrt().inverse() + margin;
    return radius.square().inverse().matrix().asDiagonal();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(R);
  const Eigen::Array3d radius = eigen.eigenvalues().array().rsqrt() + margin;
  return eigen.eigenvectors() * radius.square().inverse().matrix().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace chase::world
