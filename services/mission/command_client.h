#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/mission/states.h"

namespace chase::mission {

/// One command from giving it to its answer: sent again until it is answered.
class CommandClient {
 public:
  /// Given at time `t` [s].
  CommandClient(Event command, double t) : command_(command), start_(t), next_(t) {}

  /// True when it is to be sent now.
  bool Due(double t) {
    if (answered_ || t < next_) return false;
    next_ = t + kPeriod;
    return true;
  }
  void OnAnswer(bool accepted, const std::string& reason) {
    if (answered_) return;
    answered_ = true;
    accepted_ = accepted;
    reason_ = reason;
  }
  /// Nobody has answered for so long that nobody will.
  bool GaveUp(double t) const { return !answered_ && t - start_ > kPatience; }

  Event command() const { return command_; }
  bool answered() const { return answered_; }
  bool accepted() const { return accepted_; }
  const std::string& reason() const { return reason_; }

 private:
  static constexpr double kPeriod = 0.1;    // s
  static constexpr double kPatience = 5.0;  // s: half of world::kMostAge.command
  Event command_;
  double start_, next_;
  bool answered_ = false, accepted_ = false;
  std::string reason_;
};

/// The command of a name such as "takeoff"; nothing where there is none.
std::optional<Event> CommandNamed(const std::string& name);

/// What a state says of an accepted command to somebody who waits for its end.
enum class Progress { kUnderWay, kReached, kMissed };
Progress ProgressOf(Event command, State state);

}  // namespace chase::mission
