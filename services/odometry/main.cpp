#include "common/bus/run_service.h"
#include "services/odometry/odometry_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::odometry::OdometryNode, chase::odometry::OdometryConfig>(
      "odometry", "Estimates the drone's pose from LiDAR sweeps and the IMU.", argc, argv);
}
