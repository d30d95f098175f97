#include "services/odometry/deskew.h"

#include <algorithm>

namespace chase::odometry {

SweepMotion::SweepMotion(const std::vector<Pose>& poses_WB, double step)
    : inverse_step_(static_cast<float>(1.0 / step)) {
  const Pose X_EW = poses_WB.back().Inverse();
  knots_.reserve(poses_WB.size());
  for (const Pose& X_WB : poses_WB) {
    const Pose X_EB = X_EW * X_WB;
    knots_.push_back({X_EB.R.toRotationMatrix().cast<float>(), X_EB.p.cast<float>()});
  }
}

SweepMotion SweepMotion::Still() { return SweepMotion({Pose{}}, 1.0); }

Eigen::Vector3f SweepMotion::ToEnd(const Eigen::Vector3f& p_B, float t) const {
  const float s = std::max(0.0f, t * inverse_step_);
  const size_t i = std::min(static_cast<size_t>(s), knots_.size() - 1);
  const Knot& a = knots_[i];
  const Eigen::Vector3f from = a.R * p_B + a.p;
  if (i + 1 >= knots_.size()) return from;
  const Knot& b = knots_[i + 1];
  return from + (s - static_cast<float>(i)) * (b.R * p_B + b.p - from);
}

std::vector<FeaturePoint> Deskewed(const std::vector<SweepPoint>& points,
                                   const std::vector<int>& indices, const Pose& X_BL,
                                   const SweepMotion& motion) {
  const Eigen::Matrix3f R_BL = X_BL.R.toRotationMatrix().cast<float>();
  const Eigen::Vector3f p_BL = X_BL.p.cast<float>();
  std::vector<FeaturePoint> out;
  out.reserve(indices.size());
  for (int i : indices) {
    const SweepPoint& point = points[static_cast<size_t>(i)];
    out.push_back({motion.ToEnd(R_BL * point.p + p_BL, point.t), point.t});
  }
  return out;
}

}  // namespace chase::odometry
