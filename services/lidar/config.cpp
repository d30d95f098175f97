#include "services/lidar/config.h"

namespace chase::lidar {

std::string LidarConfig::Problem() const {
  if (source.empty()) return "source is empty; write udp or the path of a capture";
  if (port < 1 || port > 65535) return "port " + std::to_string(port) + " is not in 1..65535";
  if (clock != "arrival" && clock != "gps") return "clock is '" + clock + "', not arrival or gps";
  if (position_port < 1 || position_port > 65535 || position_port == port)
    return "position_port " + std::to_string(position_port) + " is not in 1..65535 beside port";
  if (!(cut_azimuth_deg < 360.0))
    return "cut_azimuth_deg " + std::to_string(cut_azimuth_deg) + " must be below 360";
  if (!(min_range >= 0.0)) return "min_range " + std::to_string(min_range) + " must be at least 0";
  if (!(max_range > min_range))
    return "max_range " + std::to_string(max_range) + " must exceed min_range";
  return "";
}

}  // namespace chase::lidar
