#include "services/control/control_config.h"

#include <sstream>
#include <vector>

namespace chase::control {

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

std::string ControlConfig::Problem() const {
  std::vector<Bound> bounds = {{"integral_limit", integral_limit, 0.0, 5.0},
                               {"catch_up_speed", catch_up_speed, 0.1, 20.0},
                               {"tilt_limit_deg", tilt_limit_deg, 1.0, 60.0},
                               {"min_thrust", min_thrust, 0.5, 9.0},
                               {"max_thrust", max_thrust, 11.0, 60.0},
                               {"max_body_rate", max_body_rate, 0.0, 20.0},
                               {"max_yaw_error", max_yaw_error, 0.05, 3.0},
                               {"lead", lead, 0.0, 0.3},
                               {"drone_radius", drone_radius, 0.01, 5.0},
                               {"tracking_tube", tracking_tube, 0.0, 5.0},
                               {"sigmas", sigmas, 0.0, 10.0},
                               {"reset_distance", reset_distance, 0.1, 10.0},
                               {"land_speed", land_speed, 0.1, 2.0},
                               {"lost_descent", lost_descent, 0.01, 2.0}};
  for (int i = 0; i < 3; ++i) {
    bounds.push_back({"position_gain", position_gain[i], 0.1, 50.0});
    bounds.push_back({"velocity_gain", velocity_gain[i], 0.1, 30.0});
    bounds.push_back({"integral_gain", integral_gain[i], 0.0, 20.0});
    bounds.push_back({"drag", drag[i], i == 2 ? 0.01 : 0.0, 5.0});
    // Routh: s^3 + kv s^2 + kp s + ki has its roots in the left half plane only below this.
    bounds.push_back({"integral_gain", integral_gain[i], 0.0, velocity_gain[i] * position_gain[i]});
  }
  for (const Bound& bound : bounds)
    if (std::string complaint = Complaint(bound); !complaint.empty()) return complaint;
  return "";
}

}  // namespace chase::control
