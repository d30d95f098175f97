#include "services/simulator/hardware_config.h"

namespace chase::simulator {
namespace {

std::string PortProblem(const char* name, int port) {
  if (port >= 1 && port <= 65535) return "";
  return std::string(name) + " " + std::to_string(port) + " is not in 1..65535";
}

}  // namespace

std::string HardwareConfig::Problem() const {
  if (fcu != "lcm" && fcu != "mavlink") return "fcu is '" + fcu + "', not lcm or mavlink";
  if (lidar != "lcm" && lidar != "udp") return "lidar is '" + lidar + "', not lcm or udp";
  if (camera != "lcm" && camera != "mjpeg") return "camera is '" + camera + "', not lcm or mjpeg";
  if (lidar_clock != "own" && lidar_clock != "gps")
    return "lidar_clock is '" + lidar_clock + "', not own or gps";
  if (position_port == lidar_port)
    return "position_port " + std::to_string(position_port) + " is lidar_port; take another";
  if (jpeg_quality < 1 || jpeg_quality > 100)
    return "jpeg_quality " + std::to_string(jpeg_quality) + " is not in 1..100";
  for (const std::string& problem :
       {PortProblem("fcu_port", fcu_port), PortProblem("fcu_own_port", fcu_own_port),
        PortProblem("lidar_port", lidar_port), PortProblem("position_port", position_port),
        PortProblem("camera_port", camera_port)})
    if (!problem.empty()) return problem;
  return "";
}

std::string StreamUrl(const HardwareConfig& config) {
  return "http://127.0.0.1:" + std::to_string(config.camera_port) + "/stream";
}

}  // namespace chase::simulator
