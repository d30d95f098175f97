#pragma once

#include <string>
#include <vector>

#include "common/world/geofence.h"

namespace chase::mission {

/// Parameters of the mission process.
struct MissionConfig {
  MissionConfig() {}  // as an aggregate GCC 12 takes a temporary's lists for uninitialised
  bool autostart = false;
  double give_up = 60.0;
  double home_radius = 0.3;
  double return_patience = 60.0;
  double takeoff_patience = 90.0;
  double rest_speed = 0.25;
  double battery_low = 0.25, battery_critical = 0.1;
  double climb_height = 2.0, body_radius = 0.37;
  world::Geofence geofence;
  std::vector<std::string> needs = {"prediction", "planning", "control"};

  template <class V>
  void Visit(V& v) {
    v("autostart", autostart,
      "takes off and chases by itself until the first command; for simulated flights");
    v("give_up", give_up, "returns after looking for the target for so long, s; 0: never");
    v("home_radius", home_radius, "level distance at which it is back at the take-off place, m");
    v("return_patience", return_patience,
      "lands where it is after coming to no new place on its way back for so long, s; 0: never");
    v("takeoff_patience", takeoff_patience,
      "calls a take-off off that the autopilot has not begun after so long, s; 0: never");
    v("rest_speed", rest_speed, "below this the body is at rest, m/s");
    v("battery_low", battery_low, "share of the charge at which it returns; 0: never");
    v("battery_critical", battery_critical, "share at which it lands where it is; 0: never");
    v("climb_height", climb_height,
      "above the take-off place that has to be free of obstacles, m; half of it is a climb");
    v("body_radius", body_radius,
      "of the column that is looked at for that, with planning's tracking_tube, m");
    v("geofence", geofence, "that it stays in");
    v("needs", needs, "processes without whose status it does not take off");
  }
  std::string Problem() const;
};

}  // namespace chase::mission
