#pragma once

#include "deploy/recorder/recorder_config.h"
#include "services/camera/config.h"
#include "services/control/control_config.h"
#include "services/fcu/fcu_config.h"
#include "services/lidar/config.h"
#include "services/link/link_config.h"
#include "services/mapping/mapping_config.h"
#include "services/mission/mission_config.h"
#include "services/odometry/odometry_config.h"
#include "services/perception/perception_config.h"
#include "services/planning/planning_config.h"
#include "services/prediction/prediction_node.h"
#include "services/simulator/simulator.h"
#include "services/viewer/viewer_config.h"

namespace chase::fuzz {

/// Calls f(name, config) with every service's defaults.
template <class F>
void ForEachConfig(F&& f) {
  f("camera", camera::CameraConfig{});
  f("control", control::ControlConfig{});
  f("fcu", fcu::FcuConfig{});
  f("lidar", lidar::LidarConfig{});
  f("link", link::LinkConfig{});
  f("mapping", mapping::MappingConfig{});
  f("mission", mission::MissionConfig{});
  f("odometry", odometry::OdometryConfig{});
  f("perception", perception::PerceptionConfig{});
  f("planning", planning::PlanningConfig{});
  f("prediction", prediction::PredictionConfig{});
  f("recorder", recorder::RecorderConfig{});
  f("simulator", simulator::SimulatorConfig{});
  f("viewer", viewer::ViewerConfig{});
}

}  // namespace chase::fuzz
