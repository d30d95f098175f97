#include "common/world/rig.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace chase::world {

namespace {

constexpr int kInversions = 8;  // for 1e-9 px within 60 degrees of the axis
constexpr double kStep = 1e-6;  // of differences

}  // namespace

Eigen::Matrix3d Rig::R_BL() const {
  const Eigen::Vector3d rpy = lidar_rpy_deg * M_PI / 180.0;
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Matrix3d Rig::R_BC() const {
  const double a = camera_pitch_deg * M_PI / 180.0;
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d(0.0, -1.0, 0.0);
  R.col(2) = Eigen::Vector3d(std::cos(a), 0.0, -std::sin(a));
  R.col(1) = R.col(2).cross(R.col(0));
  if (camera_roll_deg == 0.0 && camera_yaw_deg == 0.0) return R;
  const Eigen::AngleAxisd yaw(camera_yaw_deg * M_PI / 180.0, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd roll(camera_roll_deg * M_PI / 180.0, Eigen::Vector3d::UnitZ());
  return yaw.toRotationMatrix() * R * roll.toRotationMatrix();
}

/// Where the lens shows what a pinhole shows at x, both at distance 1.
Eigen::Vector2d Rig::Bent(const Eigen::Vector2d& x) const {
  const auto& k = lens_coefficients;
  const double r2 = x.squaredNorm(), r = std::sqrt(r2);
  if (lens == "fisheye") {  // Kannala and Brandt 2006
    const double a = std::atan(r), a2 = a * a;
    return r < 1e-9 ? x
                    : Eigen::Vector2d(
                          a / r * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) * x);
  }
  if (lens != "plumb_bob") return x;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));  // Brown 1966
  const double xy = 2.0 * x.x() * x.y();
  return radial * x + Eigen::Vector2d(k[2] * xy + k[3] * (r2 + 2.0 * x.x() * x.x()),
                                      k[3] * xy + k[2] * (r2 + 2.0 * x.y() * x.y()));
}

Eigen::Vector2d Rig::Project(const Eigen::Vector3d& p_C) const {
  return Eigen::Vector2d(center_u_px, center_v_px) + focal_px * Bent(p_C.head<2>() / p_C.z());
}

Eigen::Vector3d Rig::Ray(const Eigen::Vector2d& px) const {
  const Eigen::Vector2d seen = (px - Eigen::Vector2d(center_u_px, center_v_px)) / focal_px;
  Eigen::Vector2d x = seen;
  for (int i = 0; lens != "pinhole" && i < kInversions; ++i) {  // Newton's steps
    Eigen::Matrix2d J;
    for (int j = 0; j < 2; ++j)
      J.col(j) = (Bent(x + kStep * Eigen::Vector2d::Unit(j)) - Bent(x)) / kStep;
    x -= J.partialPivLu().solve(Bent(x) - seen);
  }
  return {x.x(), x.y(), 1.0};
}

std::string Rig::LensProblem() const {
  if (lens != "pinhole" && lens != "plumb_bob" && lens != "fisheye")
    return "rig.lens is '" + lens + "', must be pinhole, plumb_bob or fisheye";
  if (!lens_coefficients.allFinite()) return "rig.lens_coefficients hold what is no number";
  if (!(readout >= 0.0 && readout <= 0.1))
    return "rig.readout is " + std::to_string(readout) + ", must be 0 to 0.1";
  return "";
}

}  // namespace chase::world
