#include "services/odometry/deskew.h"

namespace chase::odometry {

SweepMotion::SweepMotion(const std::vector<Pose>& poses_WB, double step)
    : last_(static_cast<int>(poses_WB.size()) - 1), inverse_step_(static_cast<float>(1.0 / step)) {
  const Pose X_EW = poses_WB.back().Inverse();
  knots_.reserve(poses_WB.size());
  for (const Pose& X_WB : poses_WB) knots_.emplace_back(X_EW * X_WB);
}

SweepMotion SweepMotion::Still() { return SweepMotion({Pose{}}, 1.0); }

std::vector<Eigen::Vector3f> Deskewed(const std::vector<SweepPoint>& points, const Pose& X_BL,
                                      const SweepMotion& motion) {
  const FloatPose to_body(X_BL);
  std::vector<Eigen::Vector3f> out;
  out.reserve(points.size());
  for (const SweepPoint& point : points) {
    const Eigen::Vector4f p_L(point.p.x(), point.p.y(), point.p.z(), 0.0f);
    out.emplace_back(motion.ToEnd(to_body * p_L, point.t).head<3>());
  }
  return out;
}

}  // namespace chase::odometry
