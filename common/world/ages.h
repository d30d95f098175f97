#pragma once

namespace chase::world {

/// How old an input may be before whoever needs it does without, s, and what is done then.
struct MostAge {
  double sweeps = 0.19;     ///< odometry: since the last that matched; POSE is DEGRADED, without
                            ///< LiDAR soon LOST; mapping falls silent with them
  double obstacles = 0.3;   ///< UNSEEN too. planning: goes on to the committed stop where movers
                            ///< were listed, else brakes, uncertified; mission: not ready;
                            ///< prediction: nobody else moves
  double prediction = 1.4;  ///< planning: there is no target, it holds; mission: the target is lost
  double pose = 0.1;        ///< control: brakes by dead reckoning, also when poses come later than
                            ///< usual by this; silent after `velocity`; mission: not ready
  double velocity = 2.0;    ///< control: since its deviation was 0.1 m/s; brakes until then, then
                            ///< lands; mission: EMERGENCY
  double target_unseen = 1.5;  ///< prediction: since it was seen; mapping: it is an obstacle then
  double target = 0.5;         ///< mission: not ready, in flight lost; ten frames of the camera
  double status = 2.5;         ///< mission: not ready; two that are sent once a second may be lost
  double tracking = 0.3;       ///< planning: how far the body strays is not known, tubes are widest
  double flight_state = 2.0;   ///< planning: holds where it chased, searched or returned; a process
                               ///< that died is back within that
  double setpoint = 0.5;       ///< fcu: leaves the vehicle to the autopilot, whose own limit is 1 s
  double attitude = 0.5;  ///< fcu: of the autopilot; no position is sent to it, nothing is armed
  double plan = 10.0;     ///< mission: lands, as without OBSTACLES for that long; chosen: a planner
                          ///< that died is back within 5
  double landing_plan = 2.0;  ///< control: comes down where it is without a plan made to land
  double command =
      10.0;  ///< mission: refused, and fcu, a kill; chase-command repeats for half of that
};
inline constexpr MostAge kMostAge;

/// By more, s, somebody set a clock back: planning and control forget plans. Messages are late by
/// less.
inline constexpr double kSetBack = 0.3;

/// `age` [s] within `most`; what is stamped ahead by more than messages are late goes by another
/// clock, and its age is not known.
constexpr bool IsFresh(double age, double most) { return age <= most && age >= -kMostAge.pose; }

}  // namespace chase::world
