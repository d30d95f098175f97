#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/fcu/mavlink.h"

namespace chase::fcu {

/// What the bridge may ask for.
enum class Ask { kNothing, kOffboard, kArm, kLand, kDisarm, kKill };
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
  /// Asks once more for what was refused, at `utime`; the refusal is remembered until an answer
  /// comes.
  void BeginAgain(int64_t utime);
  void Drop() {
    ask_ = Ask::kNothing;
    result_.reset();
  }
  void OnAck(uint16_t command, uint8_t result, int64_t utime);
  /// The message where it is due to be sent; its target is the caller's to fill in.
  std::optional<mav::CommandLong> Tick(int64_t utime);

  Ask ask() const { return ask_; }
  Answer answer() const { return answer_; }
  /// The last answer in words; empty: none yet.
  std::string words() const { return result_ ? Words(*result_) : ""; }
  /// "landing was refused (denied)", where the last answer was a refusal, "not now" as well.
  std::string Refusal() const;

 private:
  Ask ask_ = Ask::kNothing;
  Answer answer_ = Answer::kWaiting;
  std::optional<mav::MavResult> result_;  // the last
  int64_t next_ = 0;                      // when it is sent again
  uint8_t sent_ = 0;                      // times, for the field `confirmation`
};

}  // namespace chase::fcu
