#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/fcu/mavlink_messages.h"

namespace chase::fcu {

/// PX4's mode as its heartbeat carries it (PX4-Autopilot, px4_custom_mode.h).
struct Mode {
  uint8_t main = 0, sub = 0;

  static Mode Of(uint32_t custom_mode) {
    return {static_cast<uint8_t>(custom_mode >> 16), static_cast<uint8_t>(custom_mode >> 24)};
  }
  bool operator==(const Mode& o) const { return main == o.main && sub == o.sub; }
  std::string name() const;
};
inline constexpr Mode kOffboardMode{6, 0}, kLandMode{4, 6};

/// What the bridge may ask for.
enum class Ask { kNothing, kOffboard, kArm, kLand, kDisarm };
std::string Words(Ask ask);
/// MAV_RESULT in words.
std::string Words(mav::MavResult result);

/// One command on its way: sent again while it is not answered, and while the autopilot cannot yet.
class Command {
 public:
  enum class Answer { kWaiting, kAccepted, kRefused };

  /// Takes the place of the one before; its late answers are no longer heard where it was of
  /// another kind.
  void Begin(Ask ask, int64_t utime);
  void Drop() { ask_ = Ask::kNothing; }
  void OnAck(uint16_t command, uint8_t result, int64_t utime);
  /// The message where it is due to be sent; its target is the caller's to fill in.
  std::optional<mav::CommandLong> Tick(int64_t utime);

  Ask ask() const { return ask_; }
  Answer answer() const { return answer_; }
  /// The last answer in words; empty: none yet.
  const std::string& words() const { return words_; }

 private:
  Ask ask_ = Ask::kNothing;
  Answer answer_ = Answer::kWaiting;
  std::string words_;
  int64_t next_ = 0;  // when it is sent again
  uint8_t sent_ = 0;  // times, for the field `confirmation`
};

}  // namespace chase::fcu
