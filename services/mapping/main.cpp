#include "common/bus/run_service.h"
#include "services/mapping/mapping_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::mapping::MappingNode, chase::mapping::MappingConfig>(
      "mapping", "Maps registered sweeps: octree, static ellipsoids and moving tracks.", argc,
      argv);
}
