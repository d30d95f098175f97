#pragma once

#include <Eigen/Core>

namespace chase::world {

/// Where the sensors sit on the body, and the pinhole camera. Shared by the simulator, odometry and
/// perception; a flight overrides it from one calibration file.
struct Rig {
  Eigen::Vector3d lidar_position = {0.0, 0.0, 0.10};   ///< p_BL, frame B, m
  Eigen::Vector3d lidar_rpy_deg = {0.0, 0.0, 0.0};     ///< R_BL = Rz(yaw) Ry(pitch) Rx(roll)
  Eigen::Vector3d camera_position = {0.12, 0.0, 0.0};  ///< p_BC, frame B, m
  double camera_pitch_deg = 12.0;                      ///< optical axis below x_B
  int width_px = 376, height_px = 240;
  double focal_px = 220.0;                          ///< fx = fy
  double center_u_px = 187.5, center_v_px = 119.5;  ///< principal point

  template <class V>
  void Visit(V& v) {
    v("lidar_position", lidar_position, "p_BL, m");
    v("lidar_rpy_deg", lidar_rpy_deg, "roll pitch yaw of the lidar in the body");
    v("camera_position", camera_position, "p_BC, m");
    v("camera_pitch_deg", camera_pitch_deg, "optical axis below the body's x");
    v("width_px", width_px, "of the image");
    v("height_px", height_px, "of the image");
    v("focal_px", focal_px, "fx = fy");
    v("center_u_px", center_u_px, "principal point");
    v("center_v_px", center_v_px, "principal point");
  }

  Eigen::Matrix3d R_BL() const;
  /// Columns are the camera's x (right), y (down), z (forward) in B.
  Eigen::Matrix3d R_BC() const;
  /// Pixel of a point in frame C; z must be positive.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_C) const {
    return {center_u_px + focal_px * p_C.x() / p_C.z(), center_v_px + focal_px * p_C.y() / p_C.z()};
  }
};

}  // namespace chase::world
