#include "services/simulator/projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace chase::simulator {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kNearest = 0.05;  // m in front of the camera
constexpr int kRim = 48;           // points on each rim

/// The solid's point towards that of a unit cylinder's rim: a corner of a box, on the cylinder
/// around an ellipsoid.
Eigen::Vector3d RimPoint(const world::Solid& solid, Eigen::Vector3d rim) {
  if (solid.kind != world::Solid::Kind::kBox) return solid.half_size.cwiseProduct(rim);
  rim.x() = rim.x() >= 0.0 ? 1.0 : -1.0;
  rim.y() = rim.y() >= 0.0 ? 1.0 : -1.0;
  const Eigen::AngleAxisd turn(solid.yaw, Eigen::Vector3d::UnitZ());
  return turn * solid.half_size.cwiseProduct(rim);
}

}  // namespace

PixelBox ProjectedBox(const world::Rig& rig, const Viewpoint& view, const world::Solid& cylinder) {
  const double far = std::numeric_limits<double>::infinity();
  PixelBox box{far, far, -far, -far};
  int in_front = 0;
  for (int i = 0; i < 2 * kRim; ++i) {
    const double angle = 2.0 * kPi * (i / 2) / kRim, side = i & 1 ? 1.0 : -1.0;
    const Eigen::Vector3d rim(std::cos(angle), std::sin(angle), side);
    const Eigen::Vector3d p_W = cylinder.center + RimPoint(cylinder, rim);
    const Eigen::Vector3d p_C = view.R_WC.transpose() * (p_W - view.p_WC);
    if (p_C.z() < kNearest) continue;
    ++in_front;
    const Eigen::Vector2d px = rig.Project(p_C);
    box = {std::min(box.left, px.x()), std::min(box.top, px.y()), std::max(box.right, px.x()),
           std::max(box.bottom, px.y())};
  }
  const PixelBox image{-0.5, -0.5, rig.width_px - 0.5, rig.height_px - 0.5};
  if (in_front == 0) return {};
  if (in_front < 2 * kRim) return image;
  return {std::max(box.left, image.left), std::max(box.top, image.top),
          std::min(box.right, image.right), std::min(box.bottom, image.bottom)};
}

/// Around the corners of the box around it, and a pixel more for the rounding of single precision.
PixelBox Surrounding(const world::Rig& rig, const Viewpoint& view, const world::Solid& solid) {
  const double far = std::numeric_limits<double>::infinity();
  const Eigen::AngleAxisd turn(solid.yaw, Eigen::Vector3d::UnitZ());
  PixelBox box{far, far, -far, -far};
  double nearest = far, farthest = -far;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    const Eigen::Vector3d p_W = solid.center + turn * solid.half_size.cwiseProduct(sign);
    const Eigen::Vector3d p_C = view.R_WC.transpose() * (p_W - view.p_WC);
    nearest = std::min(nearest, p_C.z()), farthest = std::max(farthest, p_C.z());
    const Eigen::Vector2d px = rig.Project(p_C);
    box = {std::min(box.left, px.x() - 1.0), std::min(box.top, px.y() - 1.0),
           std::max(box.right, px.x() + 1.0), std::max(box.bottom, px.y() + 1.0)};
  }
  if (farthest < -kNearest) return {};
  return nearest < kNearest ? PixelBox{-far, -far, far, far} : box;
}

}  // namespace chase::simulator
