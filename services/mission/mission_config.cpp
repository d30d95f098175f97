#include "services/mission/mission_config.h"

#include <sstream>

namespace chase::mission {

std::string MissionConfig::Problem() const {
  std::ostringstream text;
  if (!(give_up >= 0.0 && give_up <= 3600.0))
    text << "give_up is " << give_up << ", must be from 0 to 3600 s";
  else if (!(home_radius >= 0.05 && home_radius <= 5.0))
    text << "home_radius is " << home_radius << ", must be from 0.05 to 5 m";
  else if (!(return_patience >= 0.0 && return_patience <= 3600.0))
    text << "return_patience is " << return_patience << ", must be from 0 to 3600 s";
  else if (!(takeoff_patience >= 0.0 && takeoff_patience <= 3600.0))
    text << "takeoff_patience is " << takeoff_patience << ", must be from 0 to 3600 s";
  else if (!(rest_speed >= 0.02 && rest_speed <= 1.0))
    text << "rest_speed is " << rest_speed << ", must be from 0.02 to 1 m/s";
  else if (!(battery_critical >= 0.0 && battery_critical <= battery_low))
    text << "battery_critical is " << battery_critical << ", must be from 0 to battery_low, "
         << battery_low;
  else if (!(battery_low <= 0.9))
    text << "battery_low is " << battery_low << ", must be from 0 to 0.9";
  else if (!(climb_height >= 0.0 && climb_height <= 100.0))
    text << "climb_height is " << climb_height << ", must be from 0 to 100 m";
  else if (!(body_radius >= 0.0 && body_radius <= 5.0))
    text << "body_radius is " << body_radius << ", must be from 0 to 5 m";
  return text.str();
}

}  // namespace chase::mission
