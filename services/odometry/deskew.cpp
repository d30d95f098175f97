#include "services/odometry/deskew.h"

#include <algorithm>

namespace chase::odometry {

SweepMotion::SweepMotion(const std::vector<Pose>& poses_WB, double step)
    : inverse_step_(static_cast<float>(1.0 / step)) {
  const Pose X_EW = poses_WB.back().Inverse();
  knots_.reserve(poses_WB.size());
  for (const Pose& X_WB : poses_WB) knots_.emplace_back(X_EW * X_WB);
}

SweepMotion SweepMotion::Still() { return SweepMotion({Pose{}}, 1.0); }

Eigen::Vector3f SweepMotion::ToEnd(const Eigen::Vector3f& p_B, float t) const {
  const float s = std::max(0.0f, t * inverse_step_);
  const size_t i = std::min(static_cast<size_t>(s), knots_.size() - 1);
  const Eigen::Vector3f from = knots_[i] * p_B;
  if (i + 1 >= knots_.size()) return from;
  return from + (s - static_cast<float>(i)) * (knots_[i + 1] * p_B - from);
}

std::vector<Eigen::Vector3f> Deskewed(const std::vector<SweepPoint>& points, const Pose& X_BL,
                                      const SweepMotion& motion) {
  const FloatPose to_body(X_BL);
  std::vector<Eigen::Vector3f> out;
  out.reserve(points.size());
  for (const SweepPoint& point : points) out.push_back(motion.ToEnd(to_body * point.p, point.t));
  return out;
}

}  // namespace chase::odometry
