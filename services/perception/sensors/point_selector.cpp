#include "services/perception/sensors/point_selector.h"

#include <algorithm>
#include <cmath>

#include "services/perception/sight/silhouette.h"

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
  Placer(const RangedSweep& sweep, const PoseHistory& poses, const Camera& camera)
      : sweep_(sweep), poses_(poses), camera_(camera), R_BL_(camera.rig.R_BL()) {}

  /// False when the pose is not known at the time of point i. Must come before all else of i.
  bool MoveTo(size_t i) {
    const double t = sweep_.t() + static_cast<double>(sweep_.Time(i));
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
    return p_CL_ + R_CL_ * sweep_.Point(i).cast<double>();
  }
  TargetPoint Place(size_t i, double age) const {
    return {p_WL_ + R_WL_ * sweep_.Point(i).cast<double>(), p_WL_, age, 0.0};
  }

 private:
  const RangedSweep& sweep_;
  const PoseHistory& poses_;
  const Camera& camera_;
  Eigen::Matrix3d R_BL_;
  std::optional<PoseSample> pose_;
  Eigen::Matrix3d R_WL_, R_CL_;
  Eigen::Vector3d p_WL_, p_CL_;
};

}  // namespace

RangedSweep::RangedSweep(const Sweep& sweep) : t_(sweep.t) {
  const auto n = static_cast<Eigen::Index>(sweep.points.size());
  // What fills up the last block lies nowhere near anything.
  for (size_t k = 0; k < 4; ++k)
    columns_[k].setConstant((n + kBlock - 1) / kBlock * kBlock, k == 3 ? 1e9f : 0.0f);
  for (size_t i = 0; i < sweep.points.size(); ++i) {
    const float range = sweep.points[i].norm();
    if (!(range > static_cast<float>(kMinRange))) continue;
    if (!(sweep.times[i] >= 0.0f && sweep.times[i] < static_cast<float>(kMaxSweepLength))) continue;
    const auto at = static_cast<Eigen::Index>(times_.size());
    for (size_t k = 0; k < 3; ++k) columns_[k][at] = sweep.points[i][static_cast<int>(k)];
    columns_[3][at] = range;
    times_.push_back(sweep.times[i]);
  }
}

Eigen::Vector3f RangedSweep::Point(size_t i) const {
  const auto at = static_cast<Eigen::Index>(i);
  return {columns_[0][at], columns_[1][at], columns_[2][at]};
}

std::vector<size_t> RangedSweep::Near(const Eigen::Vector3f& sight_L, float cosine) const {
  std::vector<size_t> near;
  for (size_t from = 0; from < size(); from += kBlock) {
    const auto column = [&](size_t k) {
      return Eigen::Map<const Block>(columns_[k].data() + from);
    };
    const Block inside = column(0) * sight_L.x() +
                         (column(1) * sight_L.y() + column(2) * sight_L.z()) - cosine * column(3);
    if (inside.maxCoeff() < 0.0f) continue;
    for (size_t i = 0; i < kBlock && from + i < size(); ++i)
      if (inside[static_cast<Eigen::Index>(i)] >= 0.0f) near.push_back(from + i);
  }
  return near;
}

Clusters SelectPoints(const RangedSweep& sweep, const PoseHistory& poses, const Camera& camera,
                      double t_frame, const Detection& detection, const Eigen::Vector3d& v_WT) {
  const auto pose = poses.At(sweep.t() + 0.05, 0.06);
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
  for (const size_t i : sweep.Near(sight_L, cosine)) {
    if (!placer.MoveTo(i)) continue;
    const double age = t_frame - sweep.t() - static_cast<double>(sweep.Time(i));
    const Eigen::Vector3d now_C = placer.InCamera(i) + age * v_C;
    const auto px = camera.Pixel(now_C);
    if (!px || !OnDetection(detection, region, *px)) continue;
    hits.push_back(placer.Place(i, age));
    hits.back().range = now_C.norm();
  }
  return Split(std::move(hits));
}

}  // namespace chase::perception
