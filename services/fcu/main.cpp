#include "common/bus/run_service.h"
#include "services/fcu/fcu_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::fcu::FcuNode, chase::fcu::FcuConfig>(
      "fcu", "Speaks MAVLink with a PX4: setpoints and poses out, IMU and state in.", argc, argv);
}
