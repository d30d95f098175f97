#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>

#include "common/world/rig.h"
#include "services/perception/perception_config.h"
#include "services/perception/sensors/pose_history.h"

namespace chase::perception {

/// The camera at one time: X_WC, its rates and the lens.
struct Camera {
  world::Rig rig;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();  ///< frame W, m
  Eigen::Vector3d v_WC = Eigen::Vector3d::Zero();  ///< frame W, m/s
  Eigen::Vector3d w_WC = Eigen::Vector3d::Zero();  ///< frame W, rad/s

  /// The camera when row v [px] was read out; the pose is the middle row's.
  Camera AtRow(double v) const;

  /// Direction of the line of sight through (u, v) px, frame W, z_C component 1.
  Eigen::Vector3d Ray(double u, double v) const;
  /// Likewise through the middle of a box, px; unit.
  Eigen::Vector3d Sight(const cv::Rect2d& box) const;
  /// Pixels that one radian spans at a pixel, along the axis where they are the more.
  double PixelsPerRadian(const Eigen::Vector2d& px) const;
  /// Pixel of p_W [m]; nothing when it lies behind or nearer than 5 cm.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& p_W) const;
  /// Likewise of a point in frame C [m].
  std::optional<Eigen::Vector2d> Pixel(const Eigen::Vector3d& p_C) const;
};

/// The camera of a body at this pose.
Camera CameraAt(const PoseSample& pose, const world::Rig& rig);

/// The target's solid. A box stands upright on a square.
struct TargetShape {
  enum class Kind { kCylinder, kSphere, kBox };
  /// Variance of an unknown heading: uniform over the quarter turn after which a box looks the
  /// same, rad^2.
  static constexpr double kAnyYaw = M_PI * M_PI / 48.0;

  Kind kind = Kind::kCylinder;
  Eigen::Vector2d size = {0.15, 0.5};        ///< half the width (the radius), height, m
  double yaw = 0.0, yaw_variance = kAnyYaw;  ///< of a box, rad

  bool sphere() const { return kind == Kind::kSphere; }
  bool box() const { return kind == Kind::kBox; }
  /// Half of what is seen of the width, over all headings [m]: on average and at most.
  double MeanHalfWidth() const { return (box() ? 4.0 / M_PI : 1.0) * size[0]; }
  double MostHalfWidth() const { return (box() ? M_SQRT2 : 1.0) * size[0]; }
};

/// What is round and as wide, at any heading, as a target whose half width is `half` m.
TargetShape Round(TargetShape shape, double half);

/// The target as the config describes it.
TargetShape ShapeOf(const PerceptionConfig& config);

/// Box [px] around a target centred at p_WT, from the two rims of a cylinder or box or from the rim
/// of the sphere that is seen; nothing when any part lies behind the camera.
std::optional<cv::Rect2d> ProjectTarget(const Camera& camera, const Eigen::Vector3d& p_WT,
                                        const TargetShape& shape);

/// Likewise of a target `range` m away in the middle of `seen`, px.
std::optional<cv::Rect2d> BoxAtRange(const Camera& camera, const cv::Rect2d& seen, double range,
                                     const TargetShape& shape);

/// Range [m] at which the target shows as wide as `seen` [px], in its middle; its heading is not
/// known.
double RangeBySize(const Camera& camera, const cv::Rect2d& seen, const TargetShape& shape);

}  // namespace chase::perception
