#pragma once

#include <vector>

#include "services/planning/problem.h"

namespace chase::planning {

/// Does the target's centre stay within the image over [from,1]? The body's z axis lies along the
/// plan's acceleration plus gravity and, along the ground, drag times velocity (Mellinger & Kumar
/// 2011; Faessler, Franchi & Scaramuzza 2018), its x axis in the plane of that and the heading:
/// `yaw` (power basis in tau, rad) or, where that is null, towards the target; then the sides of
/// the image are not asked about. Certified by interval arithmetic and subdivision; what stays open
/// counts as no. Wind and the lever arm of the camera are left to the view's margin.
bool KeepsView(const Curve& plan, const Curve& target, double duration,
               const std::vector<double>* yaw, const View& view, double from = 0.0);

/// Where the target's centre appears, as tangents in the body's frame: below its level, and to the
/// left; (inf, inf) behind the camera. For one instant of a body at velocity v and acceleration a;
/// `drag`, 1/s; heading as above.
Eigen::Vector2d SeenAt(const Eigen::Vector3d& to_target, const Eigen::Vector3d& v,
                       const Eigen::Vector3d& a, double drag, const double* yaw);

}  // namespace chase::planning
