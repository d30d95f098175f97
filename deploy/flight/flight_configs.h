#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "services/camera/config.h"
#include "services/control/control_node.h"
#include "services/fcu/fcu_config.h"
#include "services/lidar/config.h"
#include "services/mapping/mapping_node.h"
#include "services/mission/mission_node.h"
#include "services/odometry/odometry_node.h"
#include "services/perception/perception_node.h"
#include "services/planning/planning_node.h"
#include "services/prediction/prediction_node.h"
#include "services/simulator/simulator_node.h"

namespace chase::flight {

/// What the command line says about a flight.
struct FlightOptions {
  std::string scenario_file;
  int64_t seed = 1;
  std::string sensors;              ///< raw or truth; empty: as the scenario says
  std::string planner;              ///< empty: planning's default
  std::vector<std::string> faults;  ///< NAME or NAME@SECONDS, besides the scenario's
  double until = -1.0;              ///< mission time at which it ends, s; else the scenario's
};

/// The configuration of every process of one flight.
struct FlightConfigs {
  simulator::SimulatorConfig simulator;
  odometry::OdometryConfig odometry;
  mapping::MappingConfig mapping;
  perception::PerceptionConfig perception;
  prediction::PredictionConfig prediction;
  planning::PlanningConfig planning;
  control::ControlConfig control;
  mission::MissionConfig mission;
  fcu::FcuConfig fcu;  ///< this and the next two: of drivers on the simulator's devices
  lidar::LidarConfig lidar;
  camera::CameraConfig camera;
  std::vector<world::FaultSpec> faults;  ///< each with its time and duration
  bool has_mission = false;              ///< in lockstep: somebody commands, or a fault strikes
};

/// Defaults, then what follows from the scenario (the start, sizes, the desired distance), then the
/// scenario's own `services` overrides, then the options. Throws std::runtime_error, one line, on a
/// bad override or a fault that does not fit.
FlightConfigs Configure(const world::Scenario& scenario, const FlightOptions& options);

/// The configuration of one process as YAML that its --config loads. Throws std::runtime_error on
/// an unknown name.
std::string DumpService(const FlightConfigs& configs, const std::string& service);

}  // namespace chase::flight
