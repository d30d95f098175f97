#include "common/bus/run_service.h"
#include "services/link/link_config.h"
#include "services/link/link_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::link::LinkNode, chase::link::LinkConfig>(
      "link", "Carries a vehicle's light messages to a ground station and its commands back.", argc,
      argv, "the link carries live messages only; chase-viewer --play LOG shows a log");
}
