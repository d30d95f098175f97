#include "common/bus/run_service.h"
#include "services/fcu/fcu_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::fcu::FcuNode, chase::fcu::FcuConfig>(
      "fcu", "Speaks MAVLink with a PX4: setpoints and poses out, IMU and state in.", argc, argv,
      "the autopilot would be sent the setpoints of a log; chase-log shows what the log holds");
}
