#include "services/perception/sensors/camera.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::perception {

namespace {

constexpr double kNearest = 0.05;  // m
constexpr int kRimPoints = 16;
constexpr int kRangeSteps = 5;  // a size is nearly inverse to the range

}  // namespace

Eigen::Vector3d Camera::Ray(double u, double v) const { return R_WC * rig.Ray({u, v}); }

Eigen::Vector3d Camera::Sight(const cv::Rect2d& box) const {
  return Ray(box.x + 0.5 * box.width, box.y + 0.5 * box.height).normalized();
}

double Camera::PixelsPerRadian(const Eigen::Vector2d& px) const {
  const auto span = [&](const Eigen::Vector2d& half) {
    const Eigen::Vector2d a = px - half, b = px + half;
    return (Ray(b.x(), b.y()).normalized() - Ray(a.x(), a.y()).normalized()).norm();
  };
  return 1.0 / std::min(span({0.5, 0.0}), span({0.0, 0.5}));
}

std::optional<Eigen::Vector2d> Camera::Project(const Eigen::Vector3d& p_W) const {
  return Pixel(R_WC.transpose() * (p_W - p_WC));
}

std::optional<Eigen::Vector2d> Camera::Pixel(const Eigen::Vector3d& p_C) const {
  if (p_C.z() < kNearest) return std::nullopt;
  return rig.Project(p_C);
}

Camera Camera::AtRow(double v) const {
  Camera camera = *this;
  const double dt = rig.readout * (v - 0.5 * (rig.height_px - 1)) / rig.height_px;
  if (dt == 0.0) return camera;
  camera.p_WC += dt * v_WC;
  camera.R_WC = math::ExpSO3(dt * w_WC) * R_WC;
  return camera;
}

Camera CameraAt(const PoseSample& pose, const world::Rig& rig) {
  const Eigen::Matrix3d R_WB = pose.R_WB.toRotationMatrix();
  const Eigen::Vector3d w_WB = R_WB * pose.w_WB_B, arm = R_WB * rig.camera_position;
  return {rig, R_WB * rig.R_BC(), pose.p_WB + arm, pose.v_WB + w_WB.cross(arm), w_WB};
}

TargetShape Round(TargetShape shape, double half) {
  if (shape.box()) shape.kind = TargetShape::Kind::kCylinder;
  shape.size[0] = half;
  return shape;
}

TargetShape ShapeOf(const PerceptionConfig& config) {
  TargetShape shape;
  shape.kind = config.target_shape == "sphere" ? TargetShape::Kind::kSphere
               : config.target_shape == "box"  ? TargetShape::Kind::kBox
                                               : TargetShape::Kind::kCylinder;
  shape.size = {config.target_radius, config.target_height};
  return shape;
}

std::optional<cv::Rect2d> ProjectTarget(const Camera& camera, const Eigen::Vector3d& p_WT,
                                        const TargetShape& shape) {
  const double radius = shape.size[0];
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  double around = radius, above = 0.5 * shape.size[1], beyond = 0.0;
  if (shape.sphere()) {  // seen is the circle along which lines of sight touch it
    const Eigen::Vector3d sight = p_WT - camera.p_WC;
    const double range = sight.norm();
    if (range <= radius) return std::nullopt;
    axes = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), sight).toRotationMatrix();
    beyond = -radius * radius / range;
    around = radius * std::sqrt(1.0 - radius * radius / (range * range));
    above = 0.0;
  }
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(shape.yaw).toRotationMatrix();
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i < 2 * kRimPoints; ++i) {
    const int step = i / 2;
    const double angle = 2.0 * M_PI * step / kRimPoints;
    Eigen::Vector2d place(std::cos(angle), std::sin(angle));
    if (shape.box()) place = turn * (place / place.lpNorm<Eigen::Infinity>());
    const Eigen::Vector3d rim(around * place.x(), around * place.y(),
                              beyond + (i % 2 ? above : -above));
    const auto px = camera.Project(p_WT + axes * rim);
    if (!px) return std::nullopt;
    low = low.cwiseMin(*px);
    high = high.cwiseMax(*px);
  }
  return cv::Rect2d(low.x(), low.y(), high.x() - low.x(), high.y() - low.y());
}

std::optional<cv::Rect2d> BoxAtRange(const Camera& camera, const cv::Rect2d& seen, double range,
                                     const TargetShape& shape) {
  return ProjectTarget(camera, camera.p_WC + range * camera.Sight(seen), shape);
}

double RangeBySize(const Camera& camera, const cv::Rect2d& seen, const TargetShape& shape) {
  const TargetShape round = Round(shape, shape.MeanHalfWidth());
  const double wanted = std::max(1.0, seen.width);
  double range = camera.rig.focal_px * 2.0 * round.size[0] / wanted;
  cv::Rect2d aim = seen;
  for (int i = 0; i < kRangeSteps; ++i) {
    const auto box = BoxAtRange(camera, aim, range, round);
    if (!box) break;  // nearer than it is large
    range *= box->width / wanted;
    aim += 0.5 * (seen.tl() + seen.br() - box->tl() - box->br());  // its centre lies beside
  }
  return range;
}

}  // namespace chase::perception
