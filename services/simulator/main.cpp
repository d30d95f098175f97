#include "common/bus/run_service.h"
#include "services/simulator/simulator_node.h"

int main(int argc, char** argv) {
  using namespace chase::simulator;
  return chase::bus::RunService<SimulatorNode, SimulatorConfig>(
      "simulator", "Simulates the world, the quadrotor and its sensors.", argc, argv);
}
