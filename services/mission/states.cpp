#include "services/mission/states.h"

#include "common/world/commands.h"

namespace chase::mission {

// clang-format off
const std::vector<Transition>& Transitions() {
  using S = State;
  using E = Event;
  static const std::vector<Transition> table = {
      {S::kIdle,      E::kComplete, S::kReady,   "nothing is missing"},
      {S::kIdle,      E::kFlying,   S::kHold,    "found in flight"},
      {S::kIdle,      E::kLanding,  S::kLand,    "found landing"},

      {S::kReady,     E::kMissing,  S::kIdle,    "something is missing"},
      {S::kReady,     E::kFlying,   S::kHold,    "found in flight"},
      {S::kReady,     E::kLanding,  S::kLand,    "found landing"},
      {S::kReady,     E::kTakeoff,  S::kTakeoff, "take-off commanded"},

      {S::kTakeoff,   E::kUp,       S::kHold,    "climbed"},
      {S::kTakeoff,   E::kChase,    S::kChase,   "chase commanded"},
      {S::kTakeoff,   E::kHold,     S::kHold,    "hold commanded"},
      {S::kTakeoff,   E::kStop,     S::kHold,    "stop commanded"},
      {S::kTakeoff,   E::kReturn,   S::kReturn,  "return commanded"},
      {S::kTakeoff,   E::kLand,     S::kLand,    "landing commanded"},

      {S::kChase,     E::kLost,     S::kSearch,  "target lost"},
      {S::kChase,     E::kChase,    S::kChase,   "chase commanded"},
      {S::kChase,     E::kHold,     S::kHold,    "hold commanded"},
      {S::kChase,     E::kStop,     S::kHold,    "stop commanded"},
      {S::kChase,     E::kSearch,   S::kSearch,  "search commanded"},
      {S::kChase,     E::kReturn,   S::kReturn,  "return commanded"},
      {S::kChase,     E::kLand,     S::kLand,    "landing commanded"},

      {S::kHold,      E::kChase,    S::kChase,   "chase commanded"},
      {S::kHold,      E::kHold,     S::kHold,    "hold commanded"},
      {S::kHold,      E::kStop,     S::kHold,    "stop commanded"},
      {S::kHold,      E::kSearch,   S::kSearch,  "search commanded"},
      {S::kHold,      E::kReturn,   S::kReturn,  "return commanded"},
      {S::kHold,      E::kLand,     S::kLand,    "landing commanded"},

      {S::kSearch,    E::kSeen,     S::kChase,   "target seen"},
      {S::kSearch,    E::kGaveUp,   S::kReturn,  "target not found in time"},
      {S::kSearch,    E::kChase,    S::kSearch,  "chase commanded, target not seen"},
      {S::kSearch,    E::kHold,     S::kHold,    "hold commanded"},
      {S::kSearch,    E::kStop,     S::kHold,    "stop commanded"},
      {S::kSearch,    E::kSearch,   S::kSearch,  "search commanded"},
      {S::kSearch,    E::kReturn,   S::kReturn,  "return commanded"},
      {S::kSearch,    E::kLand,     S::kLand,    "landing commanded"},

      {S::kReturn,    E::kHome,     S::kLand,    "back at the take-off place"},
      {S::kReturn,    E::kHomeLost, S::kLand,    "the take-off place is not known: landing here"},
      {S::kReturn,    E::kStuck,    S::kLand,    "it gets no farther on its way back: landing here"},
      {S::kReturn,    E::kChase,    S::kChase,   "chase commanded"},
      {S::kReturn,    E::kHold,     S::kHold,    "hold commanded"},
      {S::kReturn,    E::kStop,     S::kHold,    "stop commanded"},
      {S::kReturn,    E::kSearch,   S::kSearch,  "search commanded"},
      {S::kReturn,    E::kReturn,   S::kReturn,  "return commanded"},
      {S::kReturn,    E::kLand,     S::kLand,    "landing commanded"},

      {S::kLand,      E::kHold,     S::kHold,    "hold commanded"},
      {S::kLand,      E::kStop,     S::kHold,    "stop commanded"},
      {S::kLand,      E::kLand,     S::kLand,    "landing commanded"},

      {S::kEmergency, E::kPoseBack, S::kHold,    "there is a pose again"},

      // On the ground all the while.
      {S::kTakeoff,   E::kNotFlown, S::kReady,  "take-off called off"},
      {S::kChase,     E::kNotFlown, S::kReady,  "take-off called off"},
      {S::kHold,      E::kNotFlown, S::kReady,  "take-off called off"},
      {S::kSearch,    E::kNotFlown, S::kReady,  "take-off called off"},

      // Without a pose nobody but control can fly, and motors that are off stay off.
      {S::kTakeoff,   E::kPoseLost, S::kEmergency, "no pose"},
      {S::kChase,     E::kPoseLost, S::kEmergency, "no pose"},
      {S::kHold,      E::kPoseLost, S::kEmergency, "no pose"},
      {S::kSearch,    E::kPoseLost, S::kEmergency, "no pose"},
      {S::kReturn,    E::kPoseLost, S::kEmergency, "no pose"},
      {S::kLand,      E::kPoseLost, S::kEmergency, "no pose"},
      {S::kIdle,      E::kMotorsOff, S::kDone, "motors are off"},
      {S::kReady,     E::kMotorsOff, S::kDone, "motors are off"},
      {S::kTakeoff,   E::kMotorsOff, S::kDone, "motors are off"},
      {S::kChase,     E::kMotorsOff, S::kDone, "motors are off"},
      {S::kHold,      E::kMotorsOff, S::kDone, "motors are off"},
      {S::kSearch,    E::kMotorsOff, S::kDone, "motors are off"},
      {S::kReturn,    E::kMotorsOff, S::kDone, "motors are off"},
      {S::kLand,      E::kMotorsOff, S::kDone, "landed: motors are off"},
      {S::kEmergency, E::kMotorsOff, S::kDone, "landed: motors are off"},

      // The safety envelope.
      {S::kTakeoff,    E::kLeaving, S::kHold, "the way leads out of the geofence: holding inside"},
      {S::kChase,      E::kLeaving, S::kHold, "the way leads out of the geofence: holding inside"},
      {S::kSearch,     E::kLeaving, S::kHold, "the way leads out of the geofence: holding inside"},
      {S::kTakeoff,    E::kOutside, S::kReturn, "geofence breached: returning"},
      {S::kChase,      E::kOutside, S::kReturn, "geofence breached: returning"},
      {S::kSearch,     E::kOutside, S::kReturn, "geofence breached: returning"},
      {S::kHold,       E::kOutside, S::kReturn, "geofence breached: returning"},
      {S::kTakeoff,    E::kBatteryLow, S::kReturn, "battery low"},
      {S::kChase,      E::kBatteryLow, S::kReturn, "battery low"},
      {S::kSearch,     E::kBatteryLow, S::kReturn, "battery low"},
      {S::kHold,       E::kBatteryLow, S::kReturn, "battery low"},
      {S::kTakeoff,    E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {S::kChase,      E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {S::kSearch,     E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {S::kHold,       E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {S::kReturn,     E::kBatteryCritical, S::kLand, "battery critical: landing here"},
      {S::kIdle,       E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kReady,      E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kTakeoff,    E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kChase,      E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kHold,       E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kSearch,     E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kReturn,     E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kLand,       E::kKill, S::kDone, "killed: motors cut by command"},
      {S::kEmergency,  E::kKill, S::kDone, "killed: motors cut by command"},
  };
  return table;
}
// clang-format on

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
