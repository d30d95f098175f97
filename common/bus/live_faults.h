#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "chase/event_t.hpp"
#include "common/world/random.h"

namespace chase::bus {

/// Delays and losses of a live test flight (common/world/fault.h) at one process, by the rules of
/// Lockstep::SetDelay and SetLoss.
class LiveFaults {
 public:
  explicit LiveFaults(uint64_t seed = 0) : seed_(seed) {}

  /// What FAULT says. Faults of other effects are none of the bus.
  void Take(const event_t& event, const std::string& process);
  /// How late messages of the channel are, us.
  int64_t DelayOf(const std::string& channel) const;
  /// Draws whether the next message is lost. The draws follow from the seed, the fault's name and
  /// the process's.
  bool Loses();

 private:
  uint64_t seed_;
  std::map<std::string, int64_t> delays_;  // us, by channel
  double loss_ = 0.0;                      // share of messages
  world::Random draws_{0};
};

}  // namespace chase::bus
