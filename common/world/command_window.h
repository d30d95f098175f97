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
  bool unknown = false;  ///< it may have taken effect all the same: see the reason
};

/// Answers given of late, so that a command that comes again is answered and not obeyed again. A
/// command is known for as long as it may still be obeyed: older ones are refused by their age, and
/// where so many came in that time that there is no room, new ones are. Urgent ones, which do no
/// harm when obeyed twice, have room of their own and are always taken: the oldest is forgotten.
class CommandWindow {
 public:
  /// Commands from before `start` [s] are not obeyed: whoever was there then may have done so, and
  /// the answer says that. Urgent ones are, which nobody may have had. `process` is named in it.
  CommandWindow(std::string process, double start) : process_(std::move(process)), start_(start) {}

  /// The answer at time `t` [s]: the one that it got before, a refusal, or that of `obey`, which is
  /// called at most once for a command.
  template <class Obey>
  CommandAnswer Take(double t, const CommandKey& command, const Obey& obey, bool urgent = false) {
    for (Answers* answers : {&answers_, &urgent_}) {
      while (!answers->empty() && t - answers->front().first.t > kMostAge.command)
        answers->pop_front();
      for (const auto& [before, answer] : *answers)
        if (before.Key() == command.Key()) return answer;
    }
    if (!urgent && command.t < start_)
      return {false,
              "not known whether it took effect: given before the " + process_ + " process started",
              true};
    // What is refused here is not remembered: it is refused again, or has had no effect.
    if (std::string untimely = Untimely(t, command.t); !untimely.empty())
      return {false, std::move(untimely)};
    if (!urgent && answers_.size() >= kMost) return {false, "too many commands came of late"};
    if (urgent && urgent_.size() >= kMost) urgent_.pop_front();
    Answers& answers = urgent ? urgent_ : answers_;
    answers.emplace_back(command, obey());
    return answers.back().second;
  }

 private:
  using Answers = std::deque<std::pair<CommandKey, CommandAnswer>>;

  static std::string Untimely(double t, double given) {
    if (t - given > kMostAge.command) return "it is old: given more than 10 s ago";
    return given - t > kMostAge.command ? "it is given in the future: compare the clocks" : "";
  }

  static constexpr std::size_t kMost = 256;  // 25 a second for as long as they are known
  std::string process_;
  double start_;
  Answers answers_, urgent_;
};

}  // namespace chase::world
