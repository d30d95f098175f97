#pragma once

#include <array>
#include <optional>
#include <string>

namespace chase::world {

/// What an operator may want of the vehicle, by command_t's constants.
inline constexpr std::array<const char*, 9> kCommandNames = {
    "takeoff", "chase", "hold", "search", "return", "land", "stop", "kill", "select"};
inline constexpr int kKillCommand = 7;    ///< cuts the motors in the air; needs to be forced
inline constexpr int kSelectCommand = 8;  ///< names the target in the image: perception's

/// The constant of a name such as "takeoff"; nothing where there is none.
inline std::optional<int> CommandNamed(const std::string& name) {
  for (size_t i = 0; i < kCommandNames.size(); ++i)
    if (name == kCommandNames[i]) return static_cast<int>(i);
  return std::nullopt;
}

/// One command from giving it to its answer: sent again until it is answered; a kill for a while
/// longer, as mission answers it and the bridge to the autopilot obeys it, too.
class CommandClient {
 public:
  /// Given at time `t` [s].
  CommandClient(int command, double t) : command_(command), start_(t), next_(t) {}

  /// True when it is to be sent now.
  bool Due(double t) {
    if (IsDone(t) || t < next_) return false;
    next_ = t + kPeriod;
    return true;
  }
  /// `unknown`: nobody can say whether it took effect.
  void OnAnswer(bool accepted, const std::string& reason, bool unknown = false) {
    if (answered_) return;
    answered_ = true;
    accepted_ = accepted;
    unknown_ = unknown;
    reason_ = reason;
  }
  /// It has been answered, and need not be sent any more.
  bool IsDone(double t) const {
    return answered_ && (command_ != kKillCommand || t - start_ > kInsists);
  }
  /// Nobody has answered for so long that nobody will.
  bool GaveUp(double t) const { return !answered_ && t - start_ > kPatience; }

  int command() const { return command_; }  ///< one of command_t's constants
  bool answered() const { return answered_; }
  bool accepted() const { return accepted_; }
  bool unknown() const { return unknown_; }
  const std::string& reason() const { return reason_; }

 private:
  static constexpr double kPeriod = 0.1;    // s
  static constexpr double kPatience = 5.0;  // s: half of kMostAge.command
  static constexpr double kInsists = 2.0;   // s: a bridge that died is back
  int command_;
  double start_, next_;
  bool answered_ = false, accepted_ = false, unknown_ = false;
  std::string reason_;
};

}  // namespace chase::world
