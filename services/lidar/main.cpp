#include "common/bus/run_service.h"
#include "services/lidar/lidar_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::lidar::LidarNode, chase::lidar::LidarConfig>(
      "lidar", "Turns VLP-16 packets into sweeps.", argc, argv,
      "a LiDAR hears no channel, so that no log moves it; recorded packets are played as source, "
      "see --dump-config");
}
