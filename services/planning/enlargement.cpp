#include "services/planning/enlargement.h"

#include <Eigen/LU>
#include <cmath>
#include <cstring>

namespace chase::planning {
namespace {

// The inverse of the shape is (1 + s) (R^-1 + room^2 / s) for any s > 0; this s is tight across
// the axis of upright shapes.
Eigen::Matrix3d Enlarge(const Eigen::Matrix3d& R, double room) {
  const double s = room * std::sqrt(0.5 * R.trace());
  Eigen::Matrix3d inverse = R.inverse();
  inverse.diagonal().array() += room * room / s;
  return ((1.0 + s) * inverse).inverse();
}

}  // namespace

bool IsSameShape(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * 9) == 0;
}

// Along an axis the ellipsoid reaches the root of an entry of the inverse of R from its centre.
Eigen::Array3d HalfSidesOf(const Eigen::Matrix3d& R) {
  const double minor[3] = {R(1, 1) * R(2, 2) - R(1, 2) * R(1, 2),
                           R(0, 0) * R(2, 2) - R(0, 2) * R(0, 2),
                           R(0, 0) * R(1, 1) - R(0, 1) * R(0, 1)};
  const double det = R(0, 0) * minor[0] - R(0, 1) * (R(0, 1) * R(2, 2) - R(1, 2) * R(0, 2)) +
                     R(0, 2) * (R(0, 1) * R(1, 2) - R(1, 1) * R(0, 2));
  // An ill-conditioned inverse is not trusted.
  if (!(det > 1e-9 * R(0, 0) * R(1, 1) * R(2, 2))) return Eigen::Array3d::Constant(HUGE_VAL);
  Eigen::Array3d half;
  for (int a = 0; a < 3; ++a)
    half[a] = minor[a] > 0.0 ? 1.0005 * std::sqrt(minor[a] / det) : HUGE_VAL;
  return half;
}

const Enlarged& Enlargements::Of(size_t slot, const Eigen::Matrix3d& R, double room) {
  if (slot >= entries_.size()) entries_.resize(slot + 1);
  Entry& e = entries_[slot];
  if (e.by == room && IsSameShape(e.from, R)) return e.enlarged;
  e.from = R;
  e.by = room;
  e.enlarged.shape = Enlarge(R, room);
  e.enlarged.half = HalfSidesOf(e.enlarged.shape);
  return e.enlarged;
}

}  // namespace chase::planning
