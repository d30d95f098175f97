#include <algorithm>
#include <cstring>

#include "common/bus/run_service.h"
#include "services/perception/calibration_picture.h"
#include "services/perception/learn.h"
#include "services/perception/perception_node.h"

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
      "perception", "Finds the target: images, sweeps and poses in, its Gaussian out.", argc, argv);
}
