#include "services/perception/point_selector.h"

#include <algorithm>
#include <cmath>

#include "services/perception/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kMaxSweepLength = 0.15;  // s; points later in a sweep are not believed
constexpr double kMinRange = 0.3;         // m from the lidar
constexpr double kCoarseMargin = 0.25;    // rad around the detection that is looked at closely
constexpr double kJump = 0.25;            // m in range between clusters
constexpr double kExtrapolation = 0.01;   // s that a pose is carried on for a late point

/// Half the angle that the box spans, from its middle [rad].
double HalfAngle(const Camera& camera, const cv::Rect2d& box) {
  return 0.5 * std::hypot(box.width, box.height) / camera.rig.focal_px;
}

bool OnDetection(const Detection& d, const cv::Mat& region, const Eigen::Vector2d& px) {
  if (px.x() < d.box.x || px.y() < d.box.y || px.x() > d.box.x + d.box.width ||
      px.y() > d.box.y + d.box.height)
    return false;
  if (region.empty()) return true;
  const int x = static_cast<int>(std::lround(px.x())) - d.mask_box.x;
  const int y = static_cast<int>(std::lround(px.y())) - d.mask_box.y;
  return x >= 0 && y >= 0 && x < region.cols && y < region.rows && region.at<uint8_t>(y, x) != 0;
}

Clusters Split(std::vector<TargetPoint> points) {
  std::stable_sort(points.begin(), points.end(),
                   [](const TargetPoint& a, const TargetPoint& b) { return a.range < b.range; });
  Clusters clusters;
  for (const auto& p : points) {
    if (clusters.empty() || p.range - clusters.back().back().range > kJump) clusters.emplace_back();
    clusters.back().push_back(p);
  }
  return clusters;
}

/// Walks through a sweep's points near the detection; the pose is asked for once a millisecond.
class Placer {
 public:
  Placer(const Sweep& sweep, const PoseHistory& poses, const world::Rig& rig)
      : sweep_(sweep), poses_(poses), R_BL_(rig.R_BL()), p_BL_(rig.lidar_position) {}

  bool Place(size_t i, TargetPoint* out) {
    const double t = sweep_.t + static_cast<double>(sweep_.times[i]);
    if (!pose_ || std::abs(t - pose_->t) > 5e-4) pose_ = poses_.At(t, kExtrapolation);
    if (!pose_) return false;
    const Eigen::Vector3d p_B = p_BL_ + R_BL_ * sweep_.points[i].cast<double>();
    out->p_W = pose_->p_WB + pose_->R_WB * p_B;
    out->p_WL = pose_->p_WB + pose_->R_WB * p_BL_;
    return true;
  }

 private:
  const Sweep& sweep_;
  const PoseHistory& poses_;
  Eigen::Matrix3d R_BL_;
  Eigen::Vector3d p_BL_;
  std::optional<PoseSample> pose_;
};

}  // namespace

Clusters SelectPoints(const Sweep& sweep, const PoseHistory& poses, const Camera& camera,
                      double t_frame, const Detection& detection, const Eigen::Vector3d& v_WT) {
  const auto pose = poses.At(sweep.t + 0.05, 0.06);
  if (!pose) return {};
  const Eigen::Vector3d sight = camera
                                    .Ray(detection.box.x + 0.5 * detection.box.width,
                                         detection.box.y + 0.5 * detection.box.height)
                                    .normalized();
  const Eigen::Vector3f sight_L =
      (camera.rig.R_BL().transpose() * (pose->R_WB.conjugate() * sight)).cast<float>();
  const auto cosine =
      static_cast<float>(std::cos(std::min(1.5, HalfAngle(camera, detection.box) + kCoarseMargin)));
  const cv::Mat region = Region(detection);
  Placer placer(sweep, poses, camera.rig);
  std::vector<TargetPoint> hits;
  for (size_t i = 0; i < sweep.points.size(); ++i) {
    const Eigen::Vector3f& p_L = sweep.points[i];
    const float range = p_L.norm();
    if (!(range > static_cast<float>(kMinRange)) || p_L.dot(sight_L) < cosine * range) continue;
    if (!(sweep.times[i] >= 0.0f && sweep.times[i] < static_cast<float>(kMaxSweepLength))) continue;
    TargetPoint hit;
    if (!placer.Place(i, &hit)) continue;
    hit.age = t_frame - sweep.t - static_cast<double>(sweep.times[i]);
    const Eigen::Vector3d now = hit.p_W + hit.age * v_WT;
    const auto px = camera.Project(now);
    if (!px || !OnDetection(detection, region, *px)) continue;
    hit.range = (now - camera.p_WC).norm();
    hits.push_back(hit);
  }
  return Split(std::move(hits));
}

}  // namespace chase::perception
