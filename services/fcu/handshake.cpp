#include "services/fcu/handshake.h"

#include <fmt/format.h>

#include "common/world/ages.h"

namespace chase::fcu {
namespace {

using State = Handshake::State;

// PX4 wants more than 2 Hz for a second before OFFBOARD (docs.px4.io, Offboard Mode).
constexpr double kStreamBefore = 1.2;  // s
constexpr double kWithdrawn = 2.0;     // s without a setpoint: the next one is another flight's
constexpr double kHeartbeat = 1.2;     // s in which the autopilot has told its state once more
constexpr double kLateArming = 10.0;   // s after asking in which arming is still our doing
// s: the motors stand after 0.5, PX4 has landed 1.0 later, 3.0 with a range finder that does not
// see the ground.
constexpr double kLandedAfter = 5.0;
// A stream brings OFFBOARD back by itself after the failsafe that COM_OF_LOSS_T (1 s) of silence
// begin: before that much may have passed, it has to be known that there was none.
constexpr double kGap = 0.4;         // s: eighty samples of the IMU
constexpr double kLongestGap = 0.8;  // s until the autopilot has said that it still flies by us

}  // namespace

/// The rows of a state are tried in order; the first whose condition holds is taken.
struct HandshakeTable {
  struct Row {
    State from;
    bool (*when)(const Handshake&);
    State to;
    const char* why;
  };

  using H = const Handshake&;
  static bool Heard(H h) { return h.facts_.heard; }
  static bool Silent(H h) { return !h.facts_.heard; }
  static bool InOffboard(H h) { return h.facts_.mode == kOffboardMode; }
  static bool Flies(H h) { return h.facts_.armed && InOffboard(h); }
  static bool Ready(H h) { return h.facts_.wish && h.facts_.missing.empty(); }
  static bool Asked(H h) { return h.facts_.asked || !h.engages_; }
  static bool NotReady(H h) { return !Ready(h) || !Asked(h); }
  static bool TakenOver(H h) { return Flies(h) && Ready(h) && (Asked(h) || !ArmedLate(h)); }
  /// Only who lets the pilot engage streams while somebody else flies.
  static bool Others(H h) { return h.facts_.armed && !InOffboard(h) && h.engages_; }
  /// Nobody's but the autopilot's: whoever flew it may have been the process before this one.
  static bool InFailsafe(H h) {
    return h.facts_.armed && h.facts_.failsafe && !InOffboard(h) && !IsByStick(h.facts_.mode);
  }
  static bool Terminated(H h) { return h.facts_.terminated; }
  /// PX4 1.14 calls itself critical for a warning and after he has taken it from a failsafe, too.
  static bool PilotHasIt(H h) { return h.facts_.armed && IsByStick(h.facts_.mode); }
  static bool FoundInFailsafe(H h) { return h.engages_ && InFailsafe(h); }
  /// A process that comes back after an autopilot's landing goes on where it was: that is no
  /// flight.
  static bool Begins(H h) { return Ready(h) && Asked(h) && !(h.engages_ && h.facts_.armed); }
  static bool Streamed(H h) { return h.engages_ && h.InState() >= kStreamBefore; }
  static bool Refused(H h) { return h.command_.answer() == Command::Answer::kRefused; }
  static bool GivesUp(H h) { return h.InState() >= h.give_up_after_; }
  static bool LeftOffboard(H h) { return !InOffboard(h); }
  static bool Disarmed(H h) { return !h.facts_.armed; }
  static bool DisarmedOnGround(H h) { return Disarmed(h) && h.facts_.on_ground; }
  static bool NeverLeft(H h) { return DisarmedOnGround(h) && !h.left_; }
  /// An arming of ours that came through when it was no longer wanted.
  static bool ArmedLate(H h) {
    return h.facts_.armed && h.facts_.on_ground && h.AskedToArm() && !h.facts_.failsafe &&
           !PilotHasIt(h);
  }
  static bool Down(H h) { return h.facts_.motors_off && h.facts_.on_ground; }
  static bool OffInTheAir(H h) { return h.facts_.motors_off && !h.facts_.on_ground; }
  static bool Falls(H h) { return !h.facts_.borne; }
  static bool Undecided(H h) { return h.InState() >= kLandedAfter; }
  static bool Unled(H h) { return !h.facts_.wish && !h.facts_.motors_off; }
  static bool Wishes(H h) { return h.facts_.wish; }
  static bool Blind(H h) { return h.facts_.blind; }
  static bool Ceased(H h) { return h.WithoutWish() >= world::kMostAge.setpoint; }
  /// Not before an arming on its way would have been heard of.
  static bool Killed(H h) { return Disarmed(h) && h.InState() >= kHeartbeat; }
  static bool OnGround(H h) { return h.facts_.on_ground; }
  static bool Cut(H h) { return h.facts_.gap >= kLongestGap; }
  static bool PilotLands(H h) {
    const bool left = h.Told(h.since_) && !(h.facts_.mode == kLandMode) && !InOffboard(h);
    return (left && (!h.facts_.failsafe || h.lands_)) || PilotHasIt(h);
  }
  static bool Released(H h) { return h.Withdrawn() && !h.facts_.armed; }
  static bool GivenBack(H h) { return !h.engages_ && !h.facts_.failsafe; }

  static const Row kRows[];
};

constexpr const char* kTerminated = "the kill switch or a termination has stopped the motors";

const HandshakeTable::Row HandshakeTable::kRows[] = {
    {State::kNoAutopilot, Heard, State::kStandby, "a PX4 is heard"},

    {State::kStandby, Silent, State::kNoAutopilot, "the autopilot's heartbeat has ceased"},
    {State::kStandby, TakenOver, State::kFlying, "armed and in OFFBOARD already"},
    {State::kStandby, ArmedLate, State::kDisarming, "armed after we had given up"},
    {State::kStandby, FoundInFailsafe, State::kFailsafe, "found in a failsafe of the autopilot"},
    {State::kStandby, Others, State::kPilot, "somebody else flies"},
    {State::kStandby, Begins, State::kStreaming, "setpoints come"},

    {State::kStreaming, Silent, State::kNoAutopilot, "the autopilot's heartbeat has ceased"},
    {State::kStreaming, NotReady, State::kStandby, "not ready any more"},
    {State::kStreaming, Flies, State::kFlying, "armed and in OFFBOARD already"},
    {State::kStreaming, Others, State::kPilot, "somebody else has armed"},
    {State::kStreaming, Streamed, State::kOffboard, "setpoints have gone out for long enough"},

    {State::kOffboard, Silent, State::kNoAutopilot, "the autopilot's heartbeat has ceased"},
    {State::kOffboard, NotReady, State::kStandby, "not ready any more"},
    {State::kOffboard, Flies, State::kFlying, "armed and in OFFBOARD"},
    {State::kOffboard, Others, State::kPilot, "somebody else has armed"},
    {State::kOffboard, InOffboard, State::kArming, "in OFFBOARD"},
    {State::kOffboard, Refused, State::kRefused, "OFFBOARD was refused"},
    {State::kOffboard, GivesUp, State::kRefused, "OFFBOARD did not come"},

    {State::kArming, Silent, State::kNoAutopilot, "the autopilot's heartbeat has ceased"},
    {State::kArming, Flies, State::kFlying, "armed and in OFFBOARD"},
    {State::kArming, LeftOffboard, State::kPilot, "the mode was changed while we were arming"},
    {State::kArming, NotReady, State::kStandby, "not ready any more"},
    {State::kArming, Refused, State::kRefused, "arming was refused"},
    {State::kArming, GivesUp, State::kRefused, "arming did not come"},

    {State::kFlying, Terminated, State::kFailsafe, kTerminated},
    {State::kFlying, NeverLeft, State::kRefused, "the autopilot has disarmed before a take-off"},
    {State::kFlying, DisarmedOnGround, State::kDone, "the autopilot has disarmed on the ground"},
    {State::kFlying, Disarmed, State::kFailsafe, "the autopilot has disarmed or begun anew"},
    {State::kFlying, InFailsafe, State::kFailsafe, "a failsafe of the autopilot"},
    {State::kFlying, LeftOffboard, State::kPilot, "the mode was changed: the pilot has it"},
    {State::kFlying, Cut, State::kFailsafe, "the link was cut, or this bridge stood still"},
    {State::kFlying, Down, State::kDisarming, "on the ground, motors no longer wanted"},
    {State::kFlying, OffInTheAir, State::kTouchdown, "motors no longer wanted: less thrust"},
    {State::kFlying, Blind, State::kLanding, "no estimate of the pose: the autopilot lands"},
    {State::kFlying, Ceased, State::kLanding, "setpoints have ceased: the autopilot lands"},

    {State::kTouchdown, Terminated, State::kFailsafe, kTerminated},
    {State::kTouchdown, DisarmedOnGround, State::kDone, "landed and disarmed"},
    {State::kTouchdown, Disarmed, State::kFailsafe, "the autopilot has disarmed or begun anew"},
    {State::kTouchdown, InFailsafe, State::kFailsafe, "a failsafe of the autopilot"},
    {State::kTouchdown, LeftOffboard, State::kPilot, "the mode was changed: the pilot has it"},
    {State::kTouchdown, Cut, State::kFailsafe, "the link was cut, or this bridge stood still"},
    {State::kTouchdown, OnGround, State::kDisarming, "landed"},
    {State::kTouchdown, Wishes, State::kFlying, "motors are wanted again"},
    {State::kTouchdown, Falls, State::kLanding, "it is in the air: the autopilot lands"},
    {State::kTouchdown, Unled, State::kLanding, "setpoints have ceased: the autopilot lands"},
    {State::kTouchdown, Undecided, State::kLanding, "not landed by its own word: it lands"},

    {State::kLanding, Terminated, State::kFailsafe, kTerminated},
    {State::kLanding, Disarmed, State::kDone, "landed and disarmed"},
    {State::kLanding, PilotLands, State::kPilot, "the mode was changed: the pilot has it"},
    {State::kLanding, OnGround, State::kDisarming, "landed"},

    {State::kDisarming, Disarmed, State::kDone, "landed and disarmed"},
    {State::kDisarming, PilotHasIt, State::kPilot, "the mode was changed: the pilot has it"},
    {State::kDisarming, GivesUp, State::kRefused, "disarming did not come"},

    {State::kKilling, PilotHasIt, State::kPilot, "the mode was changed: the pilot has it"},
    {State::kKilling, Killed, State::kDone, "killed by command: disarmed by force"},

    {State::kDone, Released, State::kStandby, "ready for another flight"},
    {State::kPilot, GivenBack, State::kStandby, "the pilot may give it back"},
    {State::kPilot, Released, State::kStandby, "ready for another flight"},
    {State::kFailsafe, Released, State::kStandby, "ready for another flight"},
    {State::kRefused, ArmedLate, State::kDisarming, "armed after we had given up"},
    {State::kRefused, Released, State::kStandby, "ready for another flight"},
};

bool Handshake::Withdrawn() const { return WithoutWish() >= kWithdrawn; }

bool Handshake::AskedToArm() const {
  return asked_to_arm_ != 0 &&
         1e-6 * static_cast<double>(facts_.utime - asked_to_arm_) < kLateArming;
}

bool Handshake::streams() const {
  return state_ == State::kStreaming || state_ == State::kOffboard || state_ == State::kArming ||
         (Steers() && doubted_ == 0);
}

bool Handshake::needs_word() const {
  return state_ == State::kOffboard || state_ == State::kArming ||
         (facts_.armed && state_ != State::kPilot);
}

/// Who flies may have changed while the link was silent, or since the heartbeat that a process
/// which begins anew in flight has heard.
void Handshake::WatchDoubt() {
  if (!Steers() || (doubted_ != 0 && Told(doubted_)))
    doubted_ = 0;
  else if (doubted_ == 0 && facts_.gap > kGap)
    doubted_ = facts_.utime;
}

void Handshake::Update(const Facts& facts) {
  facts_ = facts;
  if (facts.wish) wished_ = facts.utime;
  if (state_ == State::kArming) asked_to_arm_ = facts.utime;
  lands_ = state_ == State::kLanding && (lands_ || (Told(since_) && facts.mode == kLandMode));
  // Landing and disarming have no alternative: what is refused is asked for again.
  if ((state_ == State::kLanding || state_ == State::kDisarming || state_ == State::kKilling) &&
      command_.answer() == Command::Answer::kRefused)
    command_.BeginAgain(facts.utime + 1'000'000);
  WatchDoubt();
  left_ = Steers() && (left_ || (facts.armed && !facts.on_ground));
  for (const HandshakeTable::Row& row : HandshakeTable::kRows)
    if (row.from == state_ && row.when(*this)) return Enter(row.to, row.why);
}

/// Once it lands nothing is asked again: whoever takes it out of that mode is the pilot, also where
/// the autopilot calls its state critical, as it does for a warning. He may have taken it since the
/// last heartbeat, too.
std::optional<mav::CommandLong> Handshake::NextCommand(int64_t utime) {
  if (state_ == State::kLanding && (facts_.mode == kLandMode || !Told(since_))) return std::nullopt;
  return command_.Tick(utime);
}

void Handshake::Kill() {
  const bool ours = state_ == State::kArming || Steers() || state_ == State::kLanding ||
                    state_ == State::kDisarming ||
                    (state_ == State::kFailsafe && !HandshakeTable::PilotHasIt(*this)) ||
                    (state_ == State::kStandby && HandshakeTable::InFailsafe(*this));
  if (ours) Enter(State::kKilling, "killed by command");
}

void Handshake::Enter(State state, const std::string& why) {
  reason_ = why;
  if (state == State::kRefused && !command_.words().empty())
    reason_ += fmt::format(" ({})", command_.words());
  if ((state == State::kRefused || state == State::kFailsafe) && !facts_.said.empty())
    reason_ += fmt::format(": {}", facts_.said);
  if (state == State::kFlying || state == State::kDone) asked_to_arm_ = 0;
  if (state == State::kFlying && state_ == State::kStandby) doubted_ = facts_.utime;
  state_ = state;
  since_ = facts_.utime;
  switch (state) {
    case State::kOffboard:
      return command_.Begin(Ask::kOffboard, facts_.utime);
    case State::kArming:
      return command_.Begin(Ask::kArm, facts_.utime);
    case State::kLanding:
      return command_.Begin(Ask::kLand, facts_.utime);
    case State::kDisarming:
      return command_.Begin(Ask::kDisarm, facts_.utime);
    case State::kKilling:
      return command_.Begin(Ask::kKill, facts_.utime);
    default:
      return command_.Drop();
  }
}

std::string Handshake::reason() const {
  const std::string refusal = command_.Refusal();
  if (refusal.empty() || lands_) return reason_;
  return fmt::format("{}; {}{}{}", reason_, refusal, facts_.said.empty() ? "" : ": ", facts_.said);
}

std::string Handshake::Name(State state) {
  static const char* const names[] = {"no autopilot", "standby", "streaming", "asking for OFFBOARD",
                                      "arming",       "flying",  "touchdown", "landing",
                                      "disarming",    "killing", "done",      "pilot",
                                      "failsafe",     "refused"};
  return names[static_cast<std::size_t>(state)];
}

}  // namespace chase::fcu
