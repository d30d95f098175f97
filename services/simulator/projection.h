#pragma once

#include <Eigen/Core>

#include "common/world/rig.h"
#include "common/world/shapes.h"

namespace chase::simulator {

/// Where the camera stands. Frame W; columns of R_WC are the camera's axes.
struct Viewpoint {
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
};

/// A rectangle of the image with real edges [px].
struct PixelBox {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;
  bool empty() const { return !(right > left && bottom > top); }
};

/// The rectangle around an upright cylinder's projection, cut to the image; empty when none of it
/// is in the image, and the whole image when it reaches behind the camera.
PixelBox ProjectedBox(const world::Rig& rig, const Viewpoint& view, const world::Solid& cylinder);

/// What a solid and a millimetre around it take of the image.
struct Outline {
  PixelBox box;        ///< not cut to the image; empty when it is behind the camera
  double depth = 0.0;  ///< of its nearest point along the optical axis, 0 at least, m
};

/// Close around the solid, also where a part of it is behind the camera.
Outline OutlineOf(const world::Rig& rig, const Viewpoint& view, const world::Solid& solid);

}  // namespace chase::simulator
