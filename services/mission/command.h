#pragma once

#include <cstdint>
#include <string>

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
};

/// What is answered.
struct Answer {
  Command command;
  bool accepted = false;
  std::string reason;
};

}  // namespace chase::mission
