#pragma once

#include <Eigen/Geometry>
#include <string>

#include "chase/geofence_t.hpp"
#include "chase/obstacle_t.hpp"
#include "chase/polynomial_t.hpp"
#include "chase/pose_t.hpp"
#include "common/world/geofence.h"
#include "common/world/obstacle.h"
#include "common/world/trajectory.h"

namespace chase::bus {

/// Seconds from `origin` to `utime`. Cores count from an origin near the data, so that double
/// precision is no concern.
inline double Seconds(int64_t utime, int64_t origin) {
  int64_t us = 0;
  if (__builtin_sub_overflow(utime, origin, &us)) us = utime < origin ? INT64_MIN : INT64_MAX;
  return static_cast<double>(us) * 1e-6;
}
int64_t Utime(double seconds, int64_t origin);

world::Trajectory FromMessage(const polynomial_t& m, int64_t origin);
polynomial_t ToMessage(const world::Trajectory& trajectory, int64_t origin);

world::Obstacle FromMessage(const obstacle_t& m, int64_t origin);
obstacle_t ToMessage(const world::Obstacle& obstacle, int64_t origin);

/// Counted from the take-off place, p_WB = `home` [m], as the core's are.
world::Geofence FromMessage(const geofence_t& m, const Eigen::Vector3d& home);

inline Eigen::Vector3d ToVector(const double (&v)[3]) { return {v[0], v[1], v[2]}; }
inline Eigen::Quaterniond ToQuaternion(const double (&q)[4]) { return {q[0], q[1], q[2], q[3]}; }
void Set(double (&out)[3], const Eigen::Vector3d& v);
void Set(double (&out)[4], const Eigen::Quaterniond& q);
/// xx xy xz yy yz zz.
Eigen::Matrix3d ToSymmetric(const double (&m)[6]);
void Set(double (&out)[6], const Eigen::Matrix3d& m);
/// Row-major 3x3.
Eigen::Matrix3d ToMatrix(const double (&m)[9]);
void Set(double (&out)[9], const Eigen::Matrix3d& m);

}  // namespace chase::bus
