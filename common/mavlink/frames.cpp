#include "common/mavlink/frames.h"

#include <cmath>

namespace chase::mavlink {

Eigen::Vector3d SwapWorld(const Eigen::Vector3d& v) { return {v.y(), v.x(), -v.z()}; }

Eigen::Vector3d SwapBody(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

Eigen::Quaterniond SwapFrames(const Eigen::Quaterniond& R) {
  // Half a turn about (1, 1, 0) takes W to NED; half a turn about x takes B to FRD.
  static const Eigen::Quaterniond world(0.0, std::sqrt(0.5), std::sqrt(0.5), 0.0);
  static const Eigen::Quaterniond body(0.0, 1.0, 0.0, 0.0);
  const Eigen::Quaterniond swapped = (world * R * body).normalized();
  return swapped.w() < 0.0 ? Eigen::Quaterniond(-swapped.coeffs()) : swapped;
}

Eigen::Matrix3d WorldSwap() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return m;
}

Eigen::Matrix3d BodySwap() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

}  // namespace chase::mavlink
