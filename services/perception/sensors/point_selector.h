#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/perception/sensors/camera.h"
#include "services/perception/sensors/pose_history.h"
#include "services/perception/sight/detector.h"

namespace chase::perception {

/// One sweep as measured: each point in frame L at its own firing time.
struct Sweep {
  double t = 0.0;                       ///< start, s
  std::vector<Eigen::Vector3f> points;  ///< frame L, m
  std::vector<float> times;             ///< after t, s; as many as points
};

/// One LiDAR point placed in the world.
struct TargetPoint {
  Eigen::Vector3d p_W;   ///< frame W, m
  Eigen::Vector3d p_WL;  ///< the lidar when it fired, frame W, m
  double age = 0.0;      ///< time of the frame minus the point's own, s
  double range = 0.0;    ///< from the camera, after compensation of the target's motion, m
};

/// Points that fall on a detection, in groups from near to far.
using Clusters = std::vector<std::vector<TargetPoint>>;

/// The points of `sweep` that, carried on by the target's velocity v_WT to the frame's time, fall
/// on the detection (its mask, or its box where it has none); split where the range jumps.
Clusters SelectPoints(const Sweep& sweep, const PoseHistory& poses, const Camera& camera,
                      double t_frame, const Detection& detection, const Eigen::Vector3d& v_WT);

}  // namespace chase::perception
