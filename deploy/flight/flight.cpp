#include "deploy/flight/flight.h"

#include <cmath>
#include <memory>

#include "common/config/config.h"
#include "deploy/flight/operator.h"

namespace chase::flight {

namespace {

template <class Node, class Config>
void Add(bus::Lockstep* lockstep, const std::string& name, const Config& config) {
  lockstep->Add(
      name, Latencies().at(name),
      [config](bus::Bus& bus) { return std::make_unique<Node>(bus, config); },
      config::Dump(config));
}

int64_t MissionUtime(double settle, double t) {
  return Flight::kPowerOn + static_cast<int64_t>(std::llround((settle + t) * 1e6));
}

}  // namespace

const std::map<std::string, int64_t>& Latencies() {
  static const std::map<std::string, int64_t> latencies = {
      {"simulator", 0},     {"odometry", 2000}, {"mapping", 20000}, {"perception", 8000},
      {"prediction", 2000}, {"planning", 2000}, {"control", 500},   {"mission", 1000},
  };
  return latencies;
}

Flight::Flight(const world::Scenario& scenario, const FlightConfigs& configs)
    : settle_(scenario.settle_s),
      lockstep_(kPowerOn),
      faults_(configs.faults, MissionUtime(settle_, 0.0), configs.simulator.seed, &lockstep_) {
  const std::string& sensors =
      configs.simulator.sensors.empty() ? scenario.sensors.mode : configs.simulator.sensors;
  Add<simulator::SimulatorNode>(&lockstep_, "simulator", configs.simulator);
  if (sensors != "truth") {
    Add<odometry::OdometryNode>(&lockstep_, "odometry", configs.odometry);
    Add<mapping::MappingNode>(&lockstep_, "mapping", configs.mapping);
    Add<perception::PerceptionNode>(&lockstep_, "perception", configs.perception);
  }
  Add<prediction::PredictionNode>(&lockstep_, "prediction", configs.prediction);
  Add<planning::PlanningNode>(&lockstep_, "planning", configs.planning);
  Add<control::ControlNode>(&lockstep_, "control", configs.control);
  if (!configs.has_mission) return;  // takes off and chases by itself
  Add<mission::MissionNode>(&lockstep_, "mission", configs.mission);
  lockstep_.Add("command", 0, [commands = scenario.commands, this](bus::Bus& bus) {
    return std::make_unique<Operator>(bus, commands, MissionUtime(settle_, 0.0));
  });
}

void Flight::RunUntil(double t) { lockstep_.RunUntil(MissionUtime(settle_, t)); }

}  // namespace chase::flight
