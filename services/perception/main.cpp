#include "common/bus/run_service.h"
#include "services/perception/perception_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::perception::PerceptionNode,
                                chase::perception::PerceptionConfig>(
      "perception", "Finds the target: images, sweeps and poses in, its Gaussian out.", argc, argv);
}
