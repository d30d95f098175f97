#include <algorithm>
#include <cstring>

#include "common/bus/run_service.h"
#include "services/perception/perception_node.h"
#include "services/perception/tools/calibration_picture.h"
#include "services/perception/tools/learn.h"

int main(int argc, char** argv) {
  const auto asks = [&](const char* flag) {
    return std::any_of(argv, argv + argc, [flag](const char* argument) {
      return std::strncmp(argument, flag, std::strlen(flag)) == 0;
    });
  };
  if (asks("--check-calibration")) return chase::perception::CheckCalibration(argc, argv);
  if (asks("--learn-colour")) return chase::perception::LearnColour(argc, argv);
  return chase::bus::RunService<chase::perception::PerceptionNode,
                                chase::perception::PerceptionConfig>(
      "perception",
      "Finds the target: images, sweeps and poses in, its Gaussian out.\n"
      "Two commands stand beside the service:\n"
      "  --learn-colour IMAGE MASK [IMAGE MASK ...] [--config BASE] [--out YAML]\n"
      "      learns the target's colour and shape from marked pictures\n"
      "  --check-calibration LOG [--at S] [--config YAML] [--out PNG]\n"
      "      draws a sweep's points into the frame S seconds after the log's first",
      argc, argv);
}
