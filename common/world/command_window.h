#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <tuple>
#include <utility>

#include "common/world/ages.h"

namespace chase::world {

/// Which command of which process it is: once obeyed it is not obeyed again.
struct CommandKey {
  std::string sender;        ///< name of the process
  int64_t sender_start = 0;  ///< when that process started, microseconds
  int64_t id = 0;            ///< among the commands of that process
  double t = 0.0;            ///< when it was given, s

  auto Key() const { return std::tie(sender, sender_start, id); }
};

/// What is answered.
struct CommandAnswer {
  bool accepted = false;
  std::string reason;
};

/// Answers given of late, so that a command that comes again is answered and not obeyed again. A
/// command is known for as long as it may still be obeyed: older ones are refused by their age, and
/// where so many came in that time that there is no room, new ones are.
class CommandWindow {
 public:
  /// Commands from before `start` [s] are refused: whoever was there then has had them. `process`
  /// is named in that refusal.
  CommandWindow(std::string process, double start) : process_(std::move(process)), start_(start) {}

  /// The answer at time `t` [s]: the one that it got before, a refusal, or that of `obey`, which is
  /// called at most once for a command.
  template <class Obey>
  CommandAnswer Take(double t, const CommandKey& command, const Obey& obey) {
    while (!answers_.empty() && t - answers_.front().first.t > kMostAge.command)
      answers_.pop_front();
    for (const auto& [before, answer] : answers_)
      if (before.Key() == command.Key()) return answer;
    // What is refused here is not remembered: it is refused again, or has had no effect.
    if (std::string untimely = Untimely(t, command.t); !untimely.empty())
      return {false, std::move(untimely)};
    answers_.emplace_back(command, obey());
    return answers_.back().second;
  }

 private:
  std::string Untimely(double t, double given) const {
    if (given < start_) return "it was given before the " + process_ + " process started";
    if (t - given > kMostAge.command) return "it is old: given more than 10 s ago";
    if (given - t > kMostAge.command) return "it is given in the future: compare the clocks";
    return answers_.size() >= kMost ? "too many commands came of late" : "";
  }

  static constexpr std::size_t kMost = 256;  // 25 a second for as long as they are known
  std::string process_;
  double start_;
  std::deque<std::pair<CommandKey, CommandAnswer>> answers_;
};

}  // namespace chase::world
