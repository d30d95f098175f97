#include "services/fcu/fcu_config.h"

#include <sstream>
#include <vector>

namespace chase::fcu {
namespace {

struct Bound {
  const char* name;
  double value, low, high;
};

std::string Complaint(const Bound& b) {
  if (b.value >= b.low && b.value <= b.high) return "";  // false for NaN
  std::ostringstream text;
  text << b.name << " is " << b.value << ", must be from " << b.low << " to " << b.high;
  return text.str();
}

}  // namespace

std::string FcuConfig::Problem() const {
  if (link.empty()) return "link is empty; write udp or the path of a serial device";
  if (engage != "setpoints" && engage != "pilot")
    return "engage is '" + engage + "', must be setpoints or pilot";
  const std::vector<Bound> bounds = {
      {"port", static_cast<double>(port), 1, 65535},
      {"baud", static_cast<double>(baud), 9600, 4'000'000},
      {"autopilot_system", static_cast<double>(autopilot_system), 0, 255},
      {"system", static_cast<double>(system), 0, 255},
      {"component", static_cast<double>(component), 2, 255},  // 1 is the autopilot itself
      {"setpoint_rate", setpoint_rate, 10.0, 200.0},          // PX4 wants more than 2 Hz
      {"odometry_rate", odometry_rate, 10.0, 100.0},
      {"imu_rate", imu_rate, 50.0, 400.0},
      {"hover_thrust", hover_thrust, 0.1, 0.9},
      {"motor_curve", motor_curve, 0.0, 1.0},
      {"attitude_gain", attitude_gain.minCoeff(), 0.1, 20.0},
      {"attitude_gain", attitude_gain.maxCoeff(), 0.1, 20.0},
      {"max_rate", max_rate, 0.1, 20.0},
      {"setpoint_age", setpoint_age, 0.01, 0.4},  // PX4's limit on silence is 0.5 s and more
      {"attitude_gate_deg", attitude_gate_deg, 1.0, 180.0},
      {"give_up_after", give_up_after, 1.0, 600.0},
      {"autopilot_silence", autopilot_silence, 1.5, 30.0},  // heartbeats come at 1 Hz
      {"signing_link", static_cast<double>(signing_link), 0, 255}};
  for (const Bound& bound : bounds)
    if (std::string complaint = Complaint(bound); !complaint.empty()) return complaint;
  return "";
}

}  // namespace chase::fcu
