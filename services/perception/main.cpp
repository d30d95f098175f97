#include <algorithm>
#include <cstring>

#include "common/bus/run_service.h"
#include "services/perception/calibration_picture.h"
#include "services/perception/perception_node.h"

int main(int argc, char** argv) {
  const auto asks = [](const char* flag) {
    return std::strncmp(flag, "--check-calibration", 19) == 0;
  };
  if (std::any_of(argv, argv + argc, asks)) return chase::perception::CheckCalibration(argc, argv);
  return chase::bus::RunService<chase::perception::PerceptionNode,
                                chase::perception::PerceptionConfig>(
      "perception", "Finds the target: images, sweeps and poses in, its Gaussian out.", argc, argv);
}
