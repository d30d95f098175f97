#include "services/fcu/command.h"

#include <fmt/format.h>

namespace chase::fcu {
namespace {

constexpr int64_t kUnanswered = 500'000;  // us until it is sent again
constexpr int64_t kTryAgain = 2'000'000;  // us after "not now", and after an effect that stays out
constexpr float kCustomModeEnabled = 1.0f;  // MAV_MODE_FLAG
// mavlink.io, MAV_CMD_COMPONENT_ARM_DISARM: without it a PX4 that has not landed does not disarm.
constexpr float kForce = 21196.0f;

/// An answer names the command alone: modes asked for by the same one would share their answers.
uint16_t Number(Ask ask) {
  return static_cast<uint16_t>(ask == Ask::kOffboard ? mav::MavCmd::DO_SET_MODE
                               : ask == Ask::kLand   ? mav::MavCmd::NAV_LAND
                                                     : mav::MavCmd::COMPONENT_ARM_DISARM);
}

mav::CommandLong Message(Ask ask) {
  mav::CommandLong m;
  m.command = Number(ask);
  if (ask == Ask::kArm) m.param1 = 1.0f;
  if (ask == Ask::kKill) m.param2 = kForce;
  if (ask == Ask::kOffboard) {
    m.param1 = kCustomModeEnabled;
    m.param2 = kOffboardMode.main;
  }
  return m;
}

}  // namespace

std::string Words(Ask ask) {
  switch (ask) {
    case Ask::kOffboard:
      return "OFFBOARD";
    case Ask::kArm:
      return "arming";
    case Ask::kLand:
      return "landing";
    case Ask::kDisarm:
      return "disarming";
    case Ask::kKill:
      return "disarming by force";
    case Ask::kNothing:
      break;
  }
  return "nothing";
}

std::string Words(mav::MavResult result) {
  using R = mav::MavResult;
  switch (result) {
    case R::ACCEPTED:
      return "accepted";
    case R::TEMPORARILY_REJECTED:
      return "not now";
    case R::DENIED:
      return "denied";
    case R::UNSUPPORTED:
      return "unsupported";
    case R::FAILED:
      return "failed";
    case R::IN_PROGRESS:
      return "in progress";
    case R::CANCELLED:
      return "cancelled";
    default:
      return fmt::format("result {}", static_cast<int>(result));
  }
}

void Command::Begin(Ask ask, int64_t utime) {
  ask_ = ask;
  answer_ = Answer::kWaiting;
  result_.reset();
  next_ = utime;
  sent_ = 0;
}

void Command::BeginAgain(int64_t utime) {
  const auto result = result_;
  Begin(ask_, utime);
  result_ = result;
}

std::string Command::Refusal() const {
  if (!result_ || *result_ == mav::MavResult::ACCEPTED || *result_ == mav::MavResult::IN_PROGRESS)
    return "";
  return fmt::format("{} was refused ({})", Words(ask_), words());
}

void Command::OnAck(uint16_t command, uint8_t result, int64_t utime) {
  if (ask_ == Ask::kNothing || sent_ == 0 || command != Number(ask_)) return;
  const auto r = static_cast<mav::MavResult>(result);
  result_ = r;
  next_ = utime + kTryAgain;
  if (r == mav::MavResult::ACCEPTED) answer_ = Answer::kAccepted;
  // "Not now" is PX4's answer to a check that fails; that may pass a moment later.
  else if (r != mav::MavResult::IN_PROGRESS && r != mav::MavResult::TEMPORARILY_REJECTED)
    answer_ = Answer::kRefused;
}

std::optional<mav::CommandLong> Command::Tick(int64_t utime) {
  if (ask_ == Ask::kNothing || answer_ == Answer::kRefused || utime < next_) return std::nullopt;
  mav::CommandLong m = Message(ask_);
  m.confirmation = sent_;
  if (sent_ < 255) ++sent_;
  next_ = utime + kUnanswered;
  return m;
}

}  // namespace chase::fcu
