#include <algorithm>
#include <string>

#include "common/bus/run_service.h"
#include "services/perception/perception_node.h"
#include "services/perception/tools/learn.h"

int main(int argc, char** argv) {
  const bool learns = std::any_of(argv, argv + argc, [](const char* argument) {
    return std::string(argument).rfind("--learn-colour", 0) == 0;
  });
  if (learns) return chase::perception::LearnColour(argc, argv);
  return chase::bus::RunService<chase::perception::PerceptionNode,
                                chase::perception::PerceptionConfig>(
      "perception",
      "Finds the target: images, sweeps and poses in, its Gaussian out.\n"
      "A command stands beside the service:\n"
      "  --learn-colour IMAGE MASK [IMAGE MASK ...] [--config BASE] [--out YAML]\n"
      "      learns the target's colour and shape from marked pictures",
      argc, argv);
}
