#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chase/scenario_t.hpp"
#include "chase/truth_t.hpp"
#include "common/world/scenario.h"

namespace chase::flight {

/// What a flight's progress line shows, from the truth.
class Progress {
 public:
  void SetScenario(const scenario_t& message);
  void Add(const truth_t& truth);

  bool started() const { return known_ && last_.mission_time >= 0.0; }
  bool done() const { return known_ && last_.mission_time >= scenario_.duration_s; }
  double mission_time() const { return last_.mission_time; }
  double duration() const { return scenario_.duration_s; }
  /// Chaser to target, m.
  double distance() const;
  /// Share of the mission so far with a free line of sight.
  double visible_ratio() const;
  /// Simulated time over the time of `now`, both since the first truth message.
  double RealTimeFactor(int64_t now) const;
  /// Remembers when the first truth message came, microseconds of the wall.
  void NoteArrival(int64_t now);
  std::string name() const { return scenario_.name; }

 private:
  bool Visible(const truth_t& truth) const;

  bool known_ = false;
  world::Scenario scenario_;
  std::vector<world::Solid> solids_;
  truth_t last_{};
  int64_t first_utime_ = -1, first_arrival_ = -1;
  long samples_ = 0, visible_ = 0;
};

}  // namespace chase::flight
