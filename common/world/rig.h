#pragma once

#include <Eigen/Core>
#include <string>

namespace chase::world {

/// Where the sensors sit on the body, and the camera: a pinhole behind a lens. Shared by the
/// simulator, odometry and perception; a flight overrides it from one calibration file.
struct Rig {
  Eigen::Vector3d lidar_position = {0.0, 0.0, 0.10};   ///< p_BL, frame B, m
  Eigen::Vector3d lidar_rpy_deg = {0.0, 0.0, 0.0};     ///< R_BL = Rz(yaw) Ry(pitch) Rx(roll)
  Eigen::Vector3d camera_position = {0.12, 0.0, 0.0};  ///< p_BC, frame B, m
  double camera_pitch_deg = 12.0;                      ///< optical axis below x_B
  double camera_roll_deg = 0.0, camera_yaw_deg = 0.0;  ///< about that axis; then about z_B
  int width_px = 376, height_px = 240;
  double focal_px = 220.0;                          ///< fx = fy
  double center_u_px = 187.5, center_v_px = 119.5;  ///< principal point
  std::string lens = "pinhole";                     ///< or plumb_bob, fisheye: OpenCV's models
  Eigen::Matrix<double, 5, 1> lens_coefficients = Eigen::Matrix<double, 5, 1>::Zero();
  double readout = 0.0;  ///< from the image's first row to its last, s; 0: all rows at once

  template <class V>
  void Visit(V& v) {
    v("lidar_position", lidar_position, "p_BL, m");
    v("lidar_rpy_deg", lidar_rpy_deg, "roll pitch yaw of the lidar in the body");
    v("camera_position", camera_position, "p_BC, m");
    v("camera_pitch_deg", camera_pitch_deg, "optical axis below the body's x");
    v("camera_roll_deg", camera_roll_deg, "about the optical axis, clockwise");
    v("camera_yaw_deg", camera_yaw_deg, "of the optical axis to the left of the body's x");
    v("width_px", width_px, "of the image");
    v("height_px", height_px, "of the image");
    v("focal_px", focal_px, "fx = fy");
    v("center_u_px", center_u_px, "principal point");
    v("center_v_px", center_v_px, "principal point");
    v("lens", lens, "pinhole, plumb_bob (k1 k2 p1 p2 k3) or fisheye (k1 k2 k3 k4)");
    v("lens_coefficients", lens_coefficients, "in OpenCV's order, the rest 0");
    v("readout", readout, "of a rolling shutter from the first row to the last, s");
  }

  Eigen::Matrix3d R_BL() const;
  /// Columns are the camera's x (right), y (down), z (forward) in B.
  Eigen::Matrix3d R_BC() const;
  /// Pixel of a point in frame C; z must be positive.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_C) const;
  /// The direction in frame C that is seen at a pixel, z component 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& px) const;
  /// A sentence that names what of the lens is not usable; or empty.
  std::string LensProblem() const;

 private:
  Eigen::Vector2d Bent(const Eigen::Vector2d& x) const;
};

}  // namespace chase::world
