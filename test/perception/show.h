#pragma once

#include <opencv2/core.hpp>
#include <random>

#include "services/perception/sensors/point_selector.h"
#include "services/perception/sensors/pose_history.h"
#include "services/simulator/actors.h"
#include "services/simulator/camera.h"
#include "services/simulator/lidar.h"
#include "services/simulator/scene.h"
#include "stage.h"

namespace chase::perception_stage {

/// A frame with the share of all the target's pixels that is seen.
struct Shot {
  cv::Mat bgr;
  double visible_share = 0.0;
};

/// What the sensors of a drone on this stage deliver. Ask in the order of time, every 5 ms.
class Show {
 public:
  Show(const Stage& stage, const world::Rig& rig);

  /// Moves on to t [s]; a sweep when one is complete.
  std::optional<perception::Sweep> Advance(double t);
  Shot Image(double t);
  perception::PoseSample Pose(double t);
  simulator::TargetState Target(double t) const;

 private:
  Stage::Body ViewAt(double t) const;
  double ShareInImage(const Stage::Body& body, const world::Solid& target) const;
  void Paint(const Stage::Body& body, simulator::Image* image);
  void PaintOne(const world::Solid& solid, const Stage::Body& body, simulator::Image* image);

  const Stage& stage_;
  world::Rig rig_;
  simulator::Actors actors_;
  simulator::Scene scene_;
  simulator::Camera camera_;
  simulator::Lidar lidar_;
  double last_t_ = 0.0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero(), tilt_ = Eigen::Vector3d::Zero();
  double last_pose_t_ = -1e9;
};

}  // namespace chase::perception_stage
