#include "deploy/flight/flight_configs.h"

#include <fmt/core.h>

#include <filesystem>
#include <stdexcept>

#include "common/config/config.h"
#include "common/world/random.h"
#include "common/world/view_angles.h"

namespace chase::flight {

namespace {

constexpr uint64_t kVehicleStream = 0x7E81C1E;  // of random numbers

template <class Config>
void Override(const world::Scenario& scenario, const std::string& service, Config* config) {
  const std::string origin = "scenario " + scenario.name + ", services: " + service;
  config::LoadText(world::ServiceConfig(scenario, service), origin, config);
}

/// What every process could read off its own data sheet: the start, sizes and the desired distance.
void Derive(const world::Scenario& scenario, FlightConfigs* configs) {
  const world::ChaserSpec& chaser = scenario.chaser;
  configs->odometry.initial_position = chaser.start;
  configs->odometry.initial_yaw_deg = chaser.yaw_deg;
  configs->perception.target_shape = scenario.target.shape;
  configs->perception.target_radius = scenario.target.radius;
  configs->perception.target_height = scenario.target.height;
  configs->planning.takeoff_height = chaser.takeoff_height;
  configs->planning.planner.desired_distance = chaser.desired_distance;
  configs->planning.planner.drone_radius = chaser.radius;
  configs->control.drone_radius = chaser.radius;
  configs->mission.climb_height = chaser.takeoff_height + chaser.radius;
  configs->mission.body_radius = configs->planning.planner.hard_radius();
  if (!scenario.commands.empty()) return;
  configs->mission.autostart = true;
  configs->mission.give_up = 0.0;
}

/// 5 to 10 % away, with a random sign, from what control and fcu believe, and a battery that sags:
/// nothing is known by accident. What the scenario names of it holds.
void DrawVehicle(int64_t seed, const control::ControlConfig& believed,
                 simulator::SimulatorConfig* config) {
  world::Random random(static_cast<uint64_t>(seed), kVehicleStream);
  const auto off = [&random] {
    const double most = random.Uniform(0.05, 0.10);
    return random.Uniform() < 0.5 ? -most : most;
  };
  simulator::VehicleConfig& vehicle = config->vehicle;
  vehicle.mass_error = off();
  // So much at the hover.
  vehicle.thrust_curve = off() / (1.0 - simulator::kGravity / vehicle.max_thrust);
  for (int i = 0; i < 3; ++i) vehicle.drag[i] = believed.drag[i] * (1.0 + off());
  config->battery.sags = true;
}

bool FedWithTruth(const world::Scenario& scenario, const FlightOptions& options) {
  return (options.sensors.empty() ? scenario.sensors.mode : options.sensors) == "truth";
}

void DeriveView(const world::Rig& rig, planning::PlannerConfig* planner) {
  const world::ViewAngles view = world::ViewOf(rig);
  planner->view_down_deg = view.down;
  planner->view_up_deg = view.up;
  planner->max_bearing_deg = view.bearing;
}

/// The drivers' data sheets: what the simulator's devices are.
void DeriveDrivers(FlightConfigs* configs) {
  const simulator::SimulatorConfig& simulated = configs->simulator;
  configs->fcu.port = simulated.hardware.fcu_port;
  configs->fcu.hover_thrust = simulator::kGravity / simulated.vehicle.max_thrust;
  configs->lidar.port = simulated.hardware.lidar_port;
  configs->lidar.position_port = simulated.hardware.position_port;
  if (simulated.hardware.lidar_clock == "gps") configs->lidar.clock = "gps";
  configs->camera.source = simulator::StreamUrl(simulated.hardware);
  configs->camera.rate_hz = simulated.camera.rate;
  configs->camera.width_px = simulated.rig.width_px;
  configs->camera.height_px = simulated.rig.height_px;
  configs->camera.exposure = simulated.camera.exposure;
}

/// Obstacles are listed as high and as far as plans lead.
void CheckVolume(const FlightConfigs& configs) {
  const planning::PlannerConfig& planner = configs.planning.planner;
  const double highest = planner.z_max + planner.drone_radius + planner.tracking_tube;
  if (highest > configs.mapping.statics.band_high)
    throw std::runtime_error(fmt::format(
        "planning: planner.z_max is {:g} m, where mapping lists obstacles up to statics.band_high "
        "{:g} m only: lower it, or raise that to {:g} m",
        planner.z_max, configs.mapping.statics.band_high, highest));
  if (configs.planning.listed_within > configs.mapping.statics.radius)
    throw std::runtime_error(fmt::format(
        "planning: listed_within is {:g} m, where mapping lists obstacles within statics.radius "
        "{:g} m only: lower it, or raise that",
        configs.planning.listed_within, configs.mapping.statics.radius));
  const double unseen = configs.mapping.statics.unseen;
  if (unseen > 0.0 && unseen < world::kFlightVolume.unseen)
    throw std::runtime_error(fmt::format(
        "mapping: statics.unseen is {:g} m, where planning steps aside up to {:g} m and counts on "
        "unseen places being listed there: raise it to that, or set 0 for none",
        unseen, world::kFlightVolume.unseen));
}

/// The scenario's faults and the command line's, in this order.
std::vector<world::FaultSpec> AllFaults(world::Scenario scenario, const FlightOptions& options) {
  for (const std::string& text : options.faults) try {
      scenario.faults.push_back(world::ParseFault(text));
      const std::string problem = scenario.Problem();
      if (!problem.empty()) throw std::runtime_error(problem);
      if (options.until > 0.0 && scenario.faults.back().at >= options.until)
        throw std::runtime_error(
            fmt::format("the flight ends at {:g} s, before it", options.until));
    } catch (const std::runtime_error& e) {
      throw std::runtime_error("--fault " + text + ": " + e.what());
    }
  return scenario.faults;
}

/// Each fault with its time and duration; the simulator gets those that are its own.
void AddFaults(const world::Scenario& scenario, const FlightOptions& options,
               FlightConfigs* configs) {
  const bool truth = configs->simulator.sensors == "truth" ||
                     (configs->simulator.sensors.empty() && scenario.sensors.mode == "truth");
  const double flown = options.until > 0.0 ? options.until : scenario.duration_s;
  int number = 0;
  for (const world::FaultSpec& fault : AllFaults(scenario, options)) {
    const world::FaultKind& kind = world::KindOf(fault);
    const std::string misfit = world::Misfit(kind, !truth);
    if (!misfit.empty() && kind.needs != world::FaultKind::Needs::kRecorder)
      throw std::runtime_error("fault " + fault.name + " " + misfit);
    configs->faults.push_back(world::Settled(fault, flown, options.seed, number++));
    if (kind.victim == "simulator") configs->simulator.faults.push_back(configs->faults.back());
  }
  configs->has_mission |= !configs->faults.empty();  // they strike what is deployed
}

}  // namespace

FlightConfigs Configure(const world::Scenario& scenario, const FlightOptions& options) {
  FlightConfigs configs;
  configs.simulator.scenario = std::filesystem::absolute(options.scenario_file).string();
  configs.simulator.seed = options.seed;
  configs.has_mission = !scenario.commands.empty();
  Derive(scenario, &configs);
  if (!FedWithTruth(scenario, options))
    DrawVehicle(options.seed, configs.control, &configs.simulator);
  Override(scenario, "simulator", &configs.simulator);
  Override(scenario, "odometry", &configs.odometry);
  Override(scenario, "mapping", &configs.mapping);
  Override(scenario, "perception", &configs.perception);
  Override(scenario, "prediction", &configs.prediction);
  DeriveView(configs.perception.rig, &configs.planning.planner);
  configs.planning.planner.drag = configs.control.drag.head<2>().mean();
  Override(scenario, "planning", &configs.planning);
  CheckVolume(configs);
  configs.control.tracking_tube = configs.planning.planner.tracking_tube;
  configs.control.sigmas = configs.planning.planner.sigmas;
  Override(scenario, "mission", &configs.mission);
  configs.control.geofence = configs.mission.geofence;
  Override(scenario, "control", &configs.control);
  DeriveDrivers(&configs);
  if (!options.sensors.empty()) configs.simulator.sensors = options.sensors;
  if (!options.planner.empty()) configs.planning.planner_name = options.planner;
  AddFaults(scenario, options, &configs);
  return configs;
}

std::string DumpService(const FlightConfigs& configs, const std::string& service) {
  if (service == "simulator") return config::Dump(configs.simulator);
  if (service == "odometry") return config::Dump(configs.odometry);
  if (service == "mapping") return config::Dump(configs.mapping);
  if (service == "perception") return config::Dump(configs.perception);
  if (service == "prediction") return config::Dump(configs.prediction);
  if (service == "planning") return config::Dump(configs.planning);
  if (service == "control") return config::Dump(configs.control);
  if (service == "mission") return config::Dump(configs.mission);
  if (service == "fcu") return config::Dump(configs.fcu);
  if (service == "lidar") return config::Dump(configs.lidar);
  if (service == "camera") return config::Dump(configs.camera);
  throw std::runtime_error(
      "--print-config " + service +
      ": no such process in a flight; use simulator, odometry, mapping, "
      "perception, prediction, planning, control, mission, fcu, lidar or camera");
}

}  // namespace chase::flight
