#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// A deskewed sweep. Frame W.
struct Sweep {
  double t = 0.0;                                    ///< s
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< p_WL, m
  std::vector<Eigen::Vector3f> points;               ///< m; some may not be finite
};

/// What a return is taken for.
enum class Label : uint8_t {
  kStatic,  ///< something solid above the ground
  kGround,
  kTarget,  ///< the target or its carrier: left out
  kMoving,  ///< a mover: left out of the static map
  kFar,     ///< beyond the range or the window: shortened, only clears space
};

struct Return {
  Eigen::Vector3f p;  ///< frame W, m
  Key key;
  Label label = Label::kStatic;
};

}  // namespace chase::mapping
