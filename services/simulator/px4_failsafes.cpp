// What the autopilot does of its own accord: checks before arming, failsafes, landing.
#include <algorithm>

#include "common/mavlink/px4_mode.h"
#include "services/simulator/px4.h"

namespace chase::simulator {
namespace {

constexpr double kKilled = 5.0;         // s of the kill switch after which it disarms
constexpr double kStickOverride = 0.3;  // COM_RC_STICK_OV, of full deflection

double Seconds(int64_t from, int64_t to) { return 1e-6 * static_cast<double>(to - from); }

}  // namespace

/// What keeps it from arming; empty: nothing.
std::string Px4::Health() const {
  if (!options_.preflight.empty()) return options_.preflight;
  if (killed_) return "Kill switch engaged";
  if (battery_warning_ >= Warning::kCritical) return "low battery";
  return mode_ == mavlink::kOffboardMode && !Streamed() ? "No offboard signal" : "";
}

/// Which check fails is said when it changes; a refusal does not repeat it.
void Px4::WatchHealth() {
  const std::string problem = armed_ ? "" : Health();
  if (!problem.empty() && problem != said_) Say("Preflight Fail: " + problem, 2);
  said_ = problem;
}

bool Px4::failsafe() const {
  return armed_ && (silent_ || unmanned_ || battery_warning_ > Warning::kNone);
}

void Px4::WatchStream() {
  const bool led = IsLed() && !drained_, was_silent = silent_;
  silent_ = led && !StreamAlive();
  if (!led) return;
  if (silent_ && !was_silent) {
    Enter(mavlink::kHoldMode, true);
    intended_ = mavlink::kOffboardMode;  // it returns by itself when the stream does
    silent_since_ = now_;
    Say("No offboard signal, failsafe", 1);
  }
  if (!silent_)
    mode_ = mavlink::kOffboardMode;
  else if (options_.loss_lands && Seconds(silent_since_, now_) >= options_.com_fail_act_t)
    mode_ = mavlink::kLandMode;
}

/// NAV_RCL_ACT 3. Where a receiver never heard one, none is missed (COM_RC_IN_MODE 4).
void Px4::WatchTransmitter() {
  if (options_.transmitter) transmitter_heard_ = now_;
  const bool was_unmanned = unmanned_;
  unmanned_ =
      armed_ && transmitter_heard_ && Seconds(*transmitter_heard_, now_) > options_.com_rc_loss_t;
  if (!unmanned_ || was_unmanned || drained_) return;
  Enter(mavlink::kLandMode, true);
  Say("Manual control lost, failsafe", 1);
}

/// COM_RC_OVERRIDE 3: from OFFBOARD, and from a landing that was asked for. With COM_FAIL_ACT_T 0 a
/// failsafe heeds the mode switch alone (failsafe/framework.cpp, AlwaysModeSwitchOnly).
void Px4::PilotSticks(double deflection) {
  const bool lands = mode_ == mavlink::kLandMode && !in_failsafe_;
  if (options_.transmitter && deflection > kStickOverride &&
      (lands || mode_ == mavlink::kOffboardMode))
    Enter(mavlink::kPositionMode);
}

Px4::Warning Px4::WarningAt(double charge) const {
  return charge < options_.bat_emergen_thr ? Warning::kEmergency
         : charge < options_.bat_crit_thr  ? Warning::kCritical
         : charge < options_.bat_low_thr   ? Warning::kLow
                                           : Warning::kNone;
}

/// While it is armed the warning only grows; each that is worse than before acts anew, also where a
/// pilot has taken over since. A return wants a position on the globe, which it has not: it lands.
void Px4::WatchBattery() {
  const Warning now = WarningAt(body_.charge), before = battery_warning_;
  battery_warning_ = armed_ ? std::max(now, before) : now;
  if (!armed_ || battery_warning_ <= before) return;
  static const char* const words[] = {"", "Low battery", "Critical battery",
                                      "Emergency battery level"};
  Say(words[static_cast<int>(battery_warning_)], battery_warning_ == Warning::kEmergency ? 0 : 2);
  Say("Failsafe activated", 2);  // for a warning, too
  if (battery_warning_ < Warning::kCritical || !options_.low_battery_lands) return;
  Enter(mavlink::kLandMode, true);
  drained_ = true;
}

void Px4::WatchKill() {
  if (!killed_) killed_since_ = now_;
  if (Seconds(killed_since_, now_) > kKilled) armed_ = false;
}

void Px4::WatchLanding() {
  const AttitudeSetpoint demand = Demand(body_);
  const double throttle = demand.motors ? demand.thrust / kGravity * options_.hover : 0.0;
  landed_ = land_detector_.Update({now_, armed_, !(mode_ == mavlink::kOffboardMode),
                                   mode_ == mavlink::kLandMode, throttle, options_.hover,
                                   body_.v_WB, body_.gyro});
  if (!landed_) landed_since_ = now_, has_flown_ = true;  // "Takeoff detected"
  if (!armed_) landed_since_ = armed_since_ = now_, has_flown_ = false;
  const double waited = Seconds(has_flown_ ? landed_since_ : armed_since_, now_);
  if (armed_ && waited > (has_flown_ ? options_.com_disarm_land : options_.com_disarm_prflt))
    armed_ = false;
}

}  // namespace chase::simulator
