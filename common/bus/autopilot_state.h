#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "chase/status_t.hpp"

namespace chase::bus {

/// What FCU_STATUS has told of the autopilot. Times in microseconds, of the same clock as utime.
class AutopilotState {
 public:
  void Hear(const status_t& message);

  /// Is it armed and ours to fly, as far as is known? Where nobody tells, as in a simulation
  /// without an autopilot, it is; so it is in the air once nobody has told for a while.
  bool Obeys(int64_t utime) const { return obeys_ || (!on_ground_ && IsOld(utime)); }
  /// Did it say last that it stands on the ground? That holds until it says otherwise: one that
  /// hears nothing from us stays there.
  bool IsOnGround() const { return on_ground_; }
  /// Did it say last that it is armed, whoever flies it?
  bool IsArmed() const { return armed_; }
  /// Did it say last that it stands there disarmed? When, us.
  std::optional<int64_t> disarmed() const { return disarmed_; }
  /// Is the flight not ours although it has begun: a pilot has it, the autopilot lands or has
  /// landed it, or never began it?
  bool IsHandedOver() const { return handed_over_; }
  /// The hand-shake's state and why it is in it: "pilot: the mode was changed"; empty: never heard.
  const std::string& words() const { return words_; }

 private:
  bool IsOld(int64_t utime) const;

  int64_t heard_ = 0;  // 0: never
  bool obeys_ = true, on_ground_ = false, armed_ = false, handed_over_ = false;
  std::optional<int64_t> disarmed_;
  std::string words_;
};

}  // namespace chase::bus
