#include "common/bus/run_service.h"
#include "services/control/control_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::control::ControlNode, chase::control::ControlConfig>(
      "control", "Flies the plan: plan and pose in, attitude and thrust out.", argc, argv);
}
