#include "services/mission/progress.h"

namespace chase::mission {

Progress ProgressOf(Event command, State state) {
  const auto is = [state](State s) { return state == s; };
  const bool over = is(State::kDone) || is(State::kEmergency);
  const auto reached_by = [over](bool reached, bool under_way) {
    return reached              ? Progress::kReached
           : over || !under_way ? Progress::kMissed
                                : Progress::kUnderWay;
  };
  const bool chases = is(State::kChase) || is(State::kSearch);
  switch (command) {
    case Event::kTakeoff:
      return reached_by(is(State::kHold) || chases, is(State::kTakeoff));
    case Event::kChase:
      return reached_by(is(State::kChase), is(State::kSearch));
    case Event::kSearch:
      return reached_by(chases, false);
    case Event::kReturn:
    case Event::kLand:
    case Event::kKill:
      return reached_by(is(State::kDone), is(State::kReturn) || is(State::kLand));
    default:
      return reached_by(is(State::kHold), false);
  }
}

}  // namespace chase::mission
