#pragma once

#include <Eigen/Geometry>
#include <string>

#include "chase/geofence_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/target_t.hpp"
#include "common/logs/protobuf.h"

namespace chase::logs {

/// Parts of Foxglove's messages.
Proto Stamp(int64_t utime);
Proto Vector(const Eigen::Vector3d& v);
Proto Rotation(const Eigen::Quaterniond& q);
Proto Pose(const Eigen::Vector3d& p, const Eigen::Quaterniond& q);
inline Eigen::Quaterniond ToRotation(const double (&q)[4]) { return {q[0], q[1], q[2], q[3]}; }

/// What Foxglove draws of a message in frame W, as a SceneUpdate whose one entity takes the place
/// of the one before: obstacles as their solids, with arrows as long as movers go in a second; the
/// target with its ellipsoid of three standard deviations; the plan in its verdict's colour and,
/// wide, its stop; the forecast with ellipsoids of two; the edges of the geofence.
std::string SceneOf(const obstacles_t& m);
std::string SceneOf(const target_t& m);
std::string SceneOf(const plan_t& m);
std::string SceneOf(const prediction_t& m);
std::string SceneOf(const geofence_t& m);

/// The solids but the ground with half their sizes larger by `radius`, m, as on chase-viewer's
/// page; an empty entity where that is 0.
std::string GrownSceneOf(const obstacles_t& m, double radius);

}  // namespace chase::logs
