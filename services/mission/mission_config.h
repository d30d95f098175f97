#pragma once

#include <string>
#include <vector>

namespace chase::mission {

/// Parameters of the mission process.
struct MissionConfig {
  bool autostart = false;
  double give_up = 60.0;
  double home_radius = 0.3;
  double rest_speed = 0.25;
  std::vector<std::string> needs = {"prediction", "planning", "control"};

  template <class V>
  void Visit(V& v) {
    v("autostart", autostart,
      "takes off and chases by itself until the first command; for simulated flights");
    v("give_up", give_up, "returns after looking for the target for so long, s; 0: never");
    v("home_radius", home_radius, "level distance at which it is back at the take-off place, m");
    v("rest_speed", rest_speed, "below this the body is at rest, m/s");
    v("needs", needs, "processes without whose status it does not take off");
  }
  std::string Problem() const;
};

}  // namespace chase::mission
