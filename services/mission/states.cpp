#include "services/mission/states.h"

#include "common/world/commands.h"

namespace chase::mission {

namespace {

struct Row {
  std::vector<State> from;
  Event on;
  State to;
  const char* reason;
};

// clang-format off
std::vector<Row> Rows() {
  using S = State;
  using E = Event;
  const std::vector<S> ground = {S::kIdle, S::kReady};
  const std::vector<S> leads = {S::kTakeoff, S::kChase, S::kSearch};
  const std::vector<S> stays_up = {S::kTakeoff, S::kChase, S::kSearch, S::kHold};
  const std::vector<S> above = {S::kTakeoff, S::kChase, S::kSearch, S::kHold, S::kReturn};
  const std::vector<S> flies = {S::kTakeoff, S::kChase, S::kSearch, S::kHold, S::kReturn, S::kLand};
  return {
      {{S::kIdle},  E::kComplete, S::kReady,   "nothing is missing"},
      {{S::kReady}, E::kMissing,  S::kIdle,    "something is missing"},
      {ground,      E::kFlying,   S::kHold,    "found in flight"},
      {ground,      E::kLanding,  S::kLand,    "found landing"},
      {{S::kReady}, E::kTakeoff,  S::kTakeoff, "take-off commanded"},

      {{S::kTakeoff, S::kChase, S::kHold, S::kReturn}, E::kChase, S::kChase, "chase commanded"},
      {{S::kSearch}, E::kChase, S::kSearch, "chase commanded, target not seen"},
      {{S::kChase, S::kHold, S::kSearch, S::kReturn}, E::kSearch, S::kSearch, "search commanded"},
      {flies, E::kHold,   S::kHold,   "hold commanded"},
      {flies, E::kStop,   S::kHold,   "stop commanded"},
      {above, E::kReturn, S::kReturn, "return commanded"},
      {flies, E::kLand,   S::kLand,   "landing commanded"},

      {{S::kTakeoff}, E::kUp,       S::kHold,   "climbed"},
      {stays_up,      E::kNotFlown, S::kReady,  "take-off called off"},
      {{S::kEmergency}, E::kNotFlown, S::kReady, "take-off called off"},
      {{S::kChase},   E::kLost,     S::kSearch, "target lost"},
      {{S::kSearch},  E::kSeen,     S::kChase,  "target seen"},
      {{S::kSearch},  E::kGaveUp,   S::kReturn, "target not found in time"},
      {{S::kReturn},  E::kHome,     S::kLand,   "back at the take-off place"},
      {{S::kReturn},  E::kHomeLost, S::kLand,   "the take-off place is not known: landing here"},
      {{S::kReturn},  E::kStuck,    S::kLand,   "it gets no farther on its way back: landing here"},

      // Without a pose nobody but control can fly, and motors that are off stay off.
      {flies, E::kPoseLost, S::kEmergency, "no pose"},
      {{S::kEmergency}, E::kPoseBack, S::kHold, "there is a pose again"},
      {ground,   E::kMotorsOff, S::kDone, "motors are off"},
      {above,    E::kMotorsOff, S::kDone, "motors are off"},
      {{S::kLand, S::kEmergency}, E::kMotorsOff, S::kDone, "landed: motors are off"},
      {flies,           E::kDisarmed, S::kDone, "the autopilot has landed and disarmed"},
      {{S::kEmergency}, E::kDisarmed, S::kDone, "the autopilot has landed and disarmed"},

      // The safety envelope.
      {leads,    E::kLeaving, S::kHold, "the way leads out of the geofence: holding inside"},
      {stays_up, E::kOutside, S::kReturn, "geofence breached: returning"},
      {stays_up, E::kBatteryLow, S::kReturn, "battery low"},
      {above,    E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {above,    E::kUnplanned, S::kLand, "planning is silent: landing here"},
      {above,    E::kUnmapped,  S::kLand, "obstacles are not heard of: landing here"},
      {ground,   E::kKill, S::kDone, "killed: motors cut by command"},
      {flies,    E::kKill, S::kDone, "killed: motors cut by command"},
      {{S::kEmergency}, E::kKill, S::kDone, "killed: motors cut by command"},
  };
}
// clang-format on

}  // namespace

const std::vector<Transition>& Transitions() {
  static const std::vector<Transition> table = [] {
    std::vector<Transition> all;
    for (const Row& row : Rows())
      for (const State from : row.from) all.push_back({from, row.on, row.to, row.reason});
    return all;
  }();
  return table;
}

const Transition* Find(State from, Event on) {
  for (const Transition& row : Transitions())
    if (row.from == from && row.on == on) return &row;
  return nullptr;
}

bool IsAirborne(State state) {
  return state != State::kIdle && state != State::kReady && state != State::kDone;
}

const char* Name(State state) {
  static constexpr const char* kNames[kStates] = {
      "IDLE", "READY", "TAKEOFF", "CHASE", "HOLD", "SEARCH", "RETURN", "LAND", "DONE", "EMERGENCY"};
  return kNames[static_cast<int>(state)];
}

const char* Name(Event command) { return world::kCommandNames[static_cast<size_t>(command)]; }

const char* Refusal(State state) {
  switch (state) {
    case State::kIdle:
      return "it is on the ground and not ready";
    case State::kReady:
      return "it is on the ground: take off first";
    case State::kTakeoff:
      return "it is climbing";
    case State::kLand:
      return "it is landing: hold first";
    case State::kDone:
      return "it has landed and its motors are off: switch it on anew";
    case State::kEmergency:
      return "it comes down without a pose and can obey nothing";
    default:
      return "it is in the air";
  }
}

}  // namespace chase::mission
