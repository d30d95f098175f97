#pragma once

#include <cstdint>
#include <string>

#include "services/fcu/command.h"

namespace chase::fcu {

/// What the hand-shake goes by, now.
struct Facts {
  int64_t utime = 0;
  bool heard = false;  ///< heartbeats of the autopilot come
  int64_t told = 0;    ///< when the last of them came, which mode and arming are from
  double gap = 0.0;    ///< s since it was last heard at all or, in flight, was last sent a setpoint
  bool armed = false;
  bool failsafe = false;    ///< the autopilot's state is CRITICAL or worse
  bool terminated = false;  ///< motors stopped by a kill switch or a termination, whatever the mode
  Mode mode;
  bool on_ground = false;   ///< as the autopilot says
  bool wish = false;        ///< a fresh setpoint wants the motors on
  bool motors_off = false;  ///< a fresh setpoint wants them off
  bool borne = false;       ///< the accelerometer shows the weight
  bool blind = false;       ///< the estimate is older than a flight may go on with
  std::string missing;      ///< what a flight must not begin without; empty: nothing
  std::string said;         ///< the autopilot's last warning
  bool asked = true;        ///< whoever leads the flights wants one, begun since the last one's end
};

/// From the first setpoint to the last: stream, OFFBOARD, arm, fly, land, disarm. The autopilot's
/// own word decides what has happened; answers to commands only say why it has not. The table of
/// states is in handshake.cpp.
class Handshake {
 public:
  enum class State {
    kNoAutopilot,
    kStandby,    ///< waits for setpoints and for what is missing
    kStreaming,  ///< setpoints go out; the autopilot wants a second of them before the switch
    kOffboard,   ///< asks for OFFBOARD
    kArming,
    kFlying,
    kTouchdown,  ///< control has felt the ground: thrust goes down until the autopilot feels it too
    kLanding,    ///< asks for AUTO.LAND
    kDisarming,
    kKilling,  ///< disarms by force, wherever it is
    kDone,     ///< these three and kRefused last until the setpoints have ceased and it is disarmed
    kPilot,
    kFailsafe,
    kRefused,
  };

  /// `engages`: it switches and arms itself; otherwise the pilot does.
  Handshake(bool engages, double give_up_after)
      : engages_(engages), give_up_after_(give_up_after) {}

  void Update(const Facts& facts);
  /// An operator wants the motors off wherever the vehicle is: obeyed while it is ours to fly,
  /// comes down after we flew it or is in a failsafe; not on the ground before and not from a pilot
  /// who has it.
  void Kill();
  void OnAck(uint16_t command, uint8_t result, int64_t utime) {
    command_.OnAck(command, result, utime);
  }
  /// The command to send now, without its target.
  std::optional<mav::CommandLong> NextCommand(int64_t utime);

  State state() const { return state_; }
  /// Is a flight over that had begun?
  bool ended() const {
    return state_ == State::kDone || state_ == State::kPilot || state_ == State::kFailsafe;
  }
  /// May setpoints be sent?
  bool streams() const;
  /// Is the autopilot's own word needed sooner than its next heartbeat is due? Who flies an armed
  /// vehicle may change at any moment.
  bool needs_word() const;
  /// Why the state is what it is, and why what is asked for in it has not come yet.
  std::string reason() const;
  static std::string Name(State state);

 private:
  friend struct HandshakeTable;

  double InState() const { return 1e-6 * static_cast<double>(facts_.utime - since_); }
  double WithoutWish() const { return 1e-6 * static_cast<double>(facts_.utime - wished_); }
  /// Is the vehicle ours to steer?
  bool Steers() const { return state_ == State::kFlying || state_ == State::kTouchdown; }
  bool Withdrawn() const;
  bool AskedToArm() const;
  /// Has the autopilot told its mode since?
  bool Told(int64_t since) const { return facts_.told > since; }
  void WatchDoubt();
  void Enter(State state, const std::string& why);

  bool engages_;
  double give_up_after_;
  State state_ = State::kNoAutopilot;
  std::string reason_ = "no heartbeat of a PX4 yet";
  Facts facts_;
  Command command_;
  int64_t since_ = 0;         // in this state
  int64_t wished_ = 0;        // when a setpoint last wanted the motors
  int64_t asked_to_arm_ = 0;  // when; 0: not yet
  bool lands_ = false;        // in kLanding: the autopilot has told that mode
  bool left_ = false;         // the ground, since it is ours to steer
  // While it steers: what a word of the autopilot has to be newer than before the stream goes on;
  // 0: it goes on.
  int64_t doubted_ = 0;
};

}  // namespace chase::fcu
