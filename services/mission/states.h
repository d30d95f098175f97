#pragma once

#include <string>
#include <vector>

namespace chase::mission {

/// Where the flight is; the numbers of flight_state_t.
enum class State {
  kIdle,
  kReady,
  kTakeoff,
  kChase,
  kHold,
  kSearch,
  kReturn,
  kLand,
  kDone,
  kEmergency,
};
inline constexpr int kStates = 10;

/// What moves the flight on. The first eight are commands, with the numbers of command_t.
enum class Event {
  kTakeoff,
  kChase,
  kHold,
  kSearch,
  kReturn,
  kLand,
  kStop,
  kKill,
  kComplete,  ///< nothing is missing
  kMissing,   ///< something is
  kFlying,    ///< control flies already
  kLanding,   ///< control comes down already
  kUp,        ///< the climb is over
  kNotFlown,  ///< nobody has flown for too long since the take-off was commanded
  kSeen,      ///< the target is tracked
  kLost,      ///< it is not
  kGaveUp,    ///< it has been looked for long enough
  kHome,      ///< over the take-off place, at rest
  kHomeLost,  ///< the take-off place is not known in the frame W of today
  kStuck,     ///< for too long it has come to no place where it had not been in this RETURN
  kPoseLost,  ///< for so long that control comes down by itself
  kPoseBack,
  kMotorsOff,
  kDisarmed,         ///< the autopilot has landed and disarmed, whoever wanted it to
  kLeaving,          ///< what is planned leads out of the geofence
  kOutside,          ///< the body is outside
  kUnplanned,        ///< planning has been silent for long
  kUnmapped,         ///< mapping has: nothing can be planned but to rest
  kBatteryLow,       ///< time to return
  kBatteryCritical,  ///< time to land
};
inline constexpr int kEvents = 30;

struct Transition {
  State from;
  Event on;
  State to;
  const char* reason;
};

/// All of them. What has no row does not move the flight; a command without a row is refused.
const std::vector<Transition>& Transitions();

/// Null where there is none.
const Transition* Find(State from, Event on);

/// Neither on the ground nor landed.
bool IsAirborne(State state);

const char* Name(State state);
/// Of a command.
const char* Name(Event command);
/// Why a state refuses the commands that it has no row for.
const char* Refusal(State state);

}  // namespace chase::mission
