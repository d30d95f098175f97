#include "services/perception/sensors/point_selector.h"

#include <algorithm>
#include <cmath>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr float kMaxSweepLength = 0.15f;  // s; points later in a sweep are not believed
constexpr float kMinRange = 0.3f;         // m from the lidar
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

/// True for a point that is believed and lies within the angle of this cosine from the unit vector.
bool Near(const Sweep& sweep, size_t i, const Eigen::Vector3f& sight_L, float cosine) {
  const Eigen::Vector3f& p = sweep.points[i];
  const float along = sight_L.dot(p), squared = p.squaredNorm();
  return along > 0.0f && along * along >= cosine * cosine * squared &&
         squared > kMinRange * kMinRange && sweep.times[i] >= 0.0f &&
         sweep.times[i] < kMaxSweepLength;
}

/// Walks through a sweep's points near the detection; the pose is asked for once a millisecond.
class Placer {
 public:
  Placer(const Sweep& sweep, const PoseHistory& poses, const Camera& camera)
      : sweep_(sweep), poses_(poses), camera_(camera), R_BL_(camera.rig.R_BL()) {}

  /// False when the pose is not known at the time of point i. Must come before all else of i.
  bool MoveTo(size_t i) {
    const double t = sweep_.t + static_cast<double>(sweep_.times[i]);
    if (pose_ && std::abs(t - pose_->t) <= 5e-4) return true;
    pose_ = poses_.At(t, kExtrapolation);
    if (!pose_) return false;
    const Eigen::Matrix3d R_CW = camera_.R_WC.transpose(), R_WB = pose_->R_WB.toRotationMatrix();
    p_WL_ = pose_->p_WB + R_WB * camera_.rig.lidar_position;
    R_WL_ = R_WB * R_BL_;
    R_CL_ = R_CW * R_WL_;
    p_CL_ = R_CW * (p_WL_ - camera_.p_WC);
    return true;
  }
  /// Frame C, m.
  Eigen::Vector3d InCamera(size_t i) const {
    return p_CL_ + R_CL_ * sweep_.points[i].cast<double>();
  }
  TargetPoint Place(size_t i, double age) const {
    return {p_WL_ + R_WL_ * sweep_.points[i].cast<double>(), p_WL_, age, 0.0};
  }

 private:
  const Sweep& sweep_;
  const PoseHistory& poses_;
  const Camera& camera_;
  Eigen::Matrix3d R_BL_;
  std::optional<PoseSample> pose_;
  Eigen::Matrix3d R_WL_, R_CL_;
  Eigen::Vector3d p_WL_, p_CL_;
};

}  // namespace

Clusters SelectPoints(const Sweep& sweep, const PoseHistory& poses, const Camera& camera,
                      double t_frame, const Detection& detection, const Eigen::Vector3d& v_WT) {
  const auto pose = poses.At(sweep.t + 0.05, 0.06);
  if (!pose) return {};
  const Eigen::Vector3d sight = camera.Sight(detection.box);
  const Eigen::Vector3f sight_L =
      (camera.rig.R_BL().transpose() * (pose->R_WB.conjugate() * sight)).cast<float>();
  const auto cosine =
      static_cast<float>(std::cos(std::min(1.5, HalfAngle(camera, detection.box) + kCoarseMargin)));
  const cv::Mat region = Region(detection);
  const Eigen::Vector3d v_C = camera.R_WC.transpose() * v_WT;  // of the target, in frame C
  Placer placer(sweep, poses, camera);
  std::vector<TargetPoint> hits;
  for (size_t i = 0; i < sweep.points.size(); ++i) {
    if (!Near(sweep, i, sight_L, cosine) || !placer.MoveTo(i)) continue;
    const double age = t_frame - sweep.t - static_cast<double>(sweep.times[i]);
    const Eigen::Vector3d now_C = placer.InCamera(i) + age * v_C;
    const auto px = camera.Pixel(now_C);
    if (!px || !OnDetection(detection, region, *px)) continue;
    hits.push_back(placer.Place(i, age));
    hits.back().range = now_C.norm();
  }
  return Split(std::move(hits));
}

}  // namespace chase::perception
