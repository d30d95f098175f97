#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// A deskewed sweep. Frame W.
struct Sweep {
  double t = 0.0;                                    ///< s
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< p_WL, m
  std::vector<Eigen::Vector3f> points;               ///< m; some may not be finite
  std::vector<float> ages;                           ///< s before t that each was fired, or empty
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< about which the scanner turns: z of L
};

/// Ages of a turning scanner's returns, from their order and azimuth in frame L: the last of the
/// turn is new, the first `period` s old. All zero if the order is not that of a turn. Moving
/// things are seen where they were at that time, whatever the sweep was deskewed to.
std::vector<float> FiringAges(const Eigen::Vector3d& origin, const Eigen::Quaterniond& R_WL,
                              const std::vector<Eigen::Vector3f>& points, double period);

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
  float age = 0.0f;  ///< s before the sweep's time
};

}  // namespace chase::mapping
