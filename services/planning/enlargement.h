#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::planning {

bool IsSameShape(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);  ///< bit for bit

/// Half the sides of the box around the ellipsoid x' R x = 1, m, and 0.05 % more, for rounding;
/// infinite where R is ill-conditioned.
Eigen::Array3d HalfSidesOf(const Eigen::Matrix3d& R);

/// A shape and half the sides of the box around it.
struct Enlarged {
  Eigen::Matrix3d shape;
  Eigen::Array3d half;
};

/// Ellipsoids that enclose an ellipsoid and all balls of some radius about its points. Remembers
/// the last answer of every slot: obstacles stay mostly the same from plan to plan.
class Enlargements {
 public:
  /// Valid until the next call.
  const Enlarged& Of(size_t slot, const Eigen::Matrix3d& R, double room);

 private:
  struct Entry {
    Eigen::Matrix3d from = Eigen::Matrix3d::Zero();
    double by = -1.0;
    Enlarged enlarged;
  };
  std::vector<Entry> entries_;
};

}  // namespace chase::planning
