#pragma once

#include "services/mission/states.h"

namespace chase::mission {

/// What a state says of an accepted command to somebody who waits for its end.
enum class Progress { kUnderWay, kReached, kMissed };
Progress ProgressOf(Event command, State state);

}  // namespace chase::mission
