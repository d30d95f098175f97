#include "common/bus/run_service.h"
#include "services/planning/planning_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::planning::PlanningNode, chase::planning::PlanningConfig>(
      "planning", "Plans the chase: prediction, obstacles and pose in, plan out.", argc, argv);
}
