#include "services/simulator/projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace chase::simulator {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kNearest = 0.05;  // m in front of the camera
constexpr int kRim = 48;           // points on each rim

// Of a solid's outline, beyond what single precision rounds.
constexpr double kSwell = 1.001;  // times its size
constexpr double kAround = 1e-3;  // m
constexpr double kPixel = 0.1;    // px
constexpr double kFront = 0.01;   // m in front of the camera, where edges are cut

/// The solid's point towards that of a unit cylinder's rim: a corner of a box, on the cylinder
/// around an ellipsoid.
Eigen::Vector3d RimPoint(const world::Solid& solid, Eigen::Vector3d rim) {
  if (solid.kind != world::Solid::Kind::kBox) return solid.half_size.cwiseProduct(rim);
  rim.x() = rim.x() >= 0.0 ? 1.0 : -1.0;
  rim.y() = rim.y() >= 0.0 ? 1.0 : -1.0;
  const Eigen::AngleAxisd turn(solid.yaw, Eigen::Vector3d::UnitZ());
  return turn * solid.half_size.cwiseProduct(rim);
}

/// An upright solid with its margin in frame C: columns of `axes` are its axes times its half
/// sizes.
struct CameraSolid {
  Eigen::Vector3d center;
  Eigen::Matrix3d axes;

  /// How far an ellipsoid, or the box around it, reaches along the optical axis.
  double Depth(bool round) const { return round ? axes.row(2).norm() : axes.row(2).lpNorm<1>(); }
  bool Near(double distance) const {
    const Eigen::Array3d sizes = axes.colwise().norm().array();
    const Eigen::Array3d p = (axes.transpose() * center).array() / sizes;
    return (p.abs() < sizes + distance).all();
  }
};

CameraSolid InFrameC(const Viewpoint& view, const world::Solid& solid) {
  const Eigen::Vector3d d = solid.center - view.p_WC;
  // A cylinder's box faces the camera.
  const double yaw =
      solid.kind == world::Solid::Kind::kCylinder ? std::atan2(d.y(), d.x()) : solid.yaw;
  const double c = std::cos(yaw), s = std::sin(yaw);
  Eigen::Matrix3d turn;
  turn << c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Vector3d half = kSwell * solid.half_size.array() + kAround;
  return {view.R_WC.transpose() * d, view.R_WC.transpose() * turn * half.asDiagonal()};
}

/// Least and greatest tangent of the angle, towards axis i of frame C, under which an ellipsoid
/// that is wholly in front is seen: the planes (1, -t) through the camera that touch it, from its
/// dual quadric (Hartley and Zisserman 2004, 8.3).
std::pair<double, double> Tangents(const CameraSolid& ellipsoid, int i) {
  const Eigen::Vector3d& p = ellipsoid.center;
  const Eigen::Matrix3d dual = ellipsoid.axes * ellipsoid.axes.transpose();
  const double a = p.z() * p.z() - dual(2, 2), b = p[i] * p.z() - dual(i, 2),
               c = p[i] * p[i] - dual(i, i);
  const double root = std::sqrt(std::max(0.0, b * b - a * c));
  return {(b - root) / a, (b + root) / a};
}

PixelBox BoxOfEllipsoid(const world::Rig& rig, const CameraSolid& ellipsoid) {
  const auto [left, right] = Tangents(ellipsoid, 0);
  const auto [top, bottom] = Tangents(ellipsoid, 1);
  return {rig.center_u_px + rig.focal_px * left - kPixel,
          rig.center_v_px + rig.focal_px * top - kPixel,
          rig.center_u_px + rig.focal_px * right + kPixel,
          rig.center_v_px + rig.focal_px * bottom + kPixel};
}

/// Around the corners of a box and where its edges come to what is in front.
PixelBox BoxOfCorners(const world::Rig& rig, const CameraSolid& box) {
  const double far = std::numeric_limits<double>::infinity();
  PixelBox around{far, far, -far, -far};
  const auto add = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector2d px = rig.Project(p);
    around = {std::min(around.left, px.x() - kPixel), std::min(around.top, px.y() - kPixel),
              std::max(around.right, px.x() + kPixel), std::max(around.bottom, px.y() + kPixel)};
  };
  Eigen::Vector3d corners[8];
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    corners[i] = box.center + box.axes * sign;
    if (corners[i].z() >= kFront) add(corners[i]);
  }
  for (int i = 0; i < 8; ++i)
    for (int axis = 1; axis < 8; axis *= 2) {
      const Eigen::Vector3d &p = corners[i], &q = corners[i ^ axis];
      if (p.z() >= kFront || q.z() < kFront) continue;
      Eigen::Vector3d cut = p + (kFront - p.z()) / (q.z() - p.z()) * (q - p);
      cut.z() = kFront;
      add(cut);
    }
  return around;
}

}  // namespace

PixelBox ProjectedBox(const world::Rig& rig, const Viewpoint& view, const world::Solid& cylinder) {
  const double far = std::numeric_limits<double>::infinity();
  PixelBox box{far, far, -far, -far};
  int in_front = 0;
  for (int i = 0; i < 2 * kRim; ++i) {
    const int step = i / 2;
    const double angle = 2.0 * kPi * step / kRim, side = i & 1 ? 1.0 : -1.0;
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

/// What is not in front by kFront is out of the image unless the camera is near: all that the image
/// shows of the space before kFront is within some multiples of that.
Outline OutlineOf(const world::Rig& rig, const Viewpoint& view, const world::Solid& solid) {
  const CameraSolid placed = InFrameC(view, solid);
  const bool round = solid.kind == world::Solid::Kind::kEllipsoid;
  const double reach = placed.Depth(round), depth = placed.center.z() - reach;
  if (placed.center.z() + reach <= 0.0) return {};
  const double across = std::hypot(rig.width_px, rig.height_px) / rig.focal_px;
  if (placed.Near(kFront * (1.0 + across))) {
    const double far = std::numeric_limits<double>::infinity();
    return {{-far, -far, far, far}, 0.0};
  }
  const bool whole = round && depth > kFront;
  return {whole ? BoxOfEllipsoid(rig, placed) : BoxOfCorners(rig, placed), std::max(0.0, depth)};
}

}  // namespace chase::simulator
