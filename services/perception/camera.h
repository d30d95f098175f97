#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>

#include "common/world/rig.h"
#include "services/perception/pose_history.h"

namespace chase::perception {

/// The camera at one time: X_WC and the pinhole.
struct Camera {
  world::Rig rig;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();  ///< frame W, m

  /// Direction of the line of sight through (u, v) px, frame W, z_C component 1.
  Eigen::Vector3d Ray(double u, double v) const;
  /// Pixel of p_W [m]; nothing when it lies behind or nearer than 5 cm.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& p_W) const;
  /// Likewise of a point in frame C [m].
  std::optional<Eigen::Vector2d> Pixel(const Eigen::Vector3d& p_C) const;
};

/// The camera of a body at this pose.
Camera CameraAt(const PoseSample& pose, const world::Rig& rig);

/// Radius and height of the upright cylinder, or of the sphere, and how well they are known.
struct TargetShape {
  bool sphere = false;
  Eigen::Vector2d size = {0.15, 0.5};                  ///< radius, height, m
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();  ///< m^2
};

/// Box [px] around a target centred at p_WT, from a cylinder's two rims or from the rim of the
/// sphere that is seen; nothing when any part lies behind the camera.
std::optional<cv::Rect2d> ProjectTarget(const Camera& camera, const Eigen::Vector3d& p_WT,
                                        const TargetShape& shape);

}  // namespace chase::perception
