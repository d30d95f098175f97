#include "common/bus/run_service.h"
#include "services/mission/mission_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::mission::MissionNode, chase::mission::MissionConfig>(
      "mission", "Leads the flight: commands and the state of everything in, flight state out.",
      argc, argv);
}
