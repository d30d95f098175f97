#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <tuple>

#include "common/world/ages.h"
#include "services/mission/states.h"

namespace chase::mission {

/// One command of one sender.
struct Command {
  std::string sender;        ///< name of the process
  int64_t sender_start = 0;  ///< when that process started, microseconds
  int64_t id = 0;            ///< among the commands of that process
  double t = 0.0;            ///< when it was given, s
  Event kind = Event::kStop;
  bool force = false;  ///< says that it is meant

  auto Key() const { return std::tie(sender, sender_start, id); }
};

/// What is answered.
struct Answer {
  Command command;
  bool accepted = false;
  std::string reason;
};

/// Answers given of late, so that a command that comes again is answered and not obeyed again. A
/// command is known for as long as it may still be obeyed: older ones are refused by their age, and
/// where so many came in that time that there is no room, new ones are.
class CommandWindow {
 public:
  /// The answer that the command got; null: it is new.
  const Answer* Find(const Command& command) const {
    for (const Answer& answer : answers_)
      if (answer.command.Key() == command.Key()) return &answer;
    return nullptr;
  }

  bool IsFull() const { return answers_.size() >= kMost; }

  const Answer& Add(Answer answer) {
    answers_.push_back(std::move(answer));
    return answers_.back();
  }

  /// Forgets commands that would be refused at time `t` [s] anyway.
  void Forget(double t) {
    while (!answers_.empty() && t - answers_.front().command.t > world::kMostAge.command)
      answers_.pop_front();
  }

 private:
  static constexpr size_t kMost = 256;  // 25 a second for as long as they are known
  std::deque<Answer> answers_;
};

}  // namespace chase::mission
