#pragma once

#include <vector>

#include "services/planning/problem.h"

namespace chase::planning {

/// Does the target's centre stay within the image over [from,1]? The body's z axis lies along the
/// plan's acceleration plus gravity and, along the ground, drag times velocity (Mellinger & Kumar
/// 2011; Faessler, Franchi & Scaramuzza 2018), its x axis in the plane of that and the heading:
/// `yaw` (power basis in tau, rad) or, where that is null, towards the target; then the sides of
/// the image are not asked about. Certified by affine arithmetic and subdivision; what stays open
/// counts as no. Wind and the lever arm of the camera are left to the view's margin.
bool KeepsView(const Curve& plan, const Curve& target, double duration,
               const std::vector<double>* yaw, const View& view, double from = 0.0);

/// Tangent of the angle by which the target's centre is seen below the level of a body at velocity
/// v and acceleration a that heads for it; inf where it is not in front. `drag`, 1/s.
double SeenBelow(const Eigen::Vector3d& to_target, const Eigen::Vector3d& v,
                 const Eigen::Vector3d& a, double drag);

}  // namespace chase::planning
