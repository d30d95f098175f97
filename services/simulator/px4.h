#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/mavlink/framing.h"
#include "common/mavlink/px4_mode.h"
#include "common/world/random.h"
#include "services/simulator/own_mode.h"
#include "services/simulator/px4_land_detector.h"

namespace chase::simulator {

/// Parameters of PX4 by their own names, and what a test may break.
struct Px4Options {
  double com_of_loss_t = 1.0;       ///< s without setpoints until OFFBOARD is left
  double com_fail_act_t = 0.0;      ///< s in Hold before it does what a lost stream asks for
  double com_rc_loss_t = 0.5;       ///< s without a transmitter after which it lands
  bool transmitter = false;         ///< a receiver hears one
  double com_disarm_land = 2.0;     ///< s on the ground after landing until it disarms
  double com_disarm_prflt = 10.0;   ///< s armed without a take-off until it disarms
  bool loss_lands = true;           ///< COM_OBL_RC_ACT: land, otherwise hold
  bool low_battery_lands = true;    ///< COM_LOW_BAT_ACT 2 or 3: land, otherwise only warn
  double hover = 0.5;               ///< share of full thrust that balances gravity
  double bat_low_thr = 0.15;        ///< charge below which it warns
  double bat_crit_thr = 0.07;       ///< charge below which it lands, where it does
  double bat_emergen_thr = 0.05;    ///< charge below which it does so again
  int ekf2_ev_qmin = 0;             ///< quality of ODOMETRY below which it is left out; 0: none
  double lost_acks = 0.0;           ///< probability
  bool starts_in_version_1 = true;  ///< of the protocol, until it hears version 2
  double drift_ppm = 30.0;          ///< of its clock
  std::string preflight;            ///< a check that fails; empty: none
  bool refuses_offboard = false, refuses_to_arm = false;  ///< with DENIED
  bool refuses_to_land = false;                           ///< as well
  int autopilot = 12;                                     ///< MAV_AUTOPILOT of its heartbeat
};

/// PX4 as its documents describe it and as a real one was measured: OFFBOARD, arming, refusals,
/// failsafes, streams, clocks (docs.px4.io: Offboard Mode, Safety; mavlink.io: Command, Timesync).
/// Knows no socket and no clock: times are the host's, microseconds; its own clock began kBoot
/// before the first one.
class Px4 {
 public:
  using Bytes = std::vector<uint8_t>;

  Px4(const Px4Options& options, int64_t utime, uint64_t seed);

  /// A datagram that arrived at `arrival` and is looked at when the host's clock says `clock`.
  void Receive(int64_t arrival, int64_t clock, const Bytes& bytes);
  /// Applies the rules and sends what is due; times must not fall. `clock`: the host's, which a
  /// busy simulation's `utime` lags behind.
  void Tick(int64_t utime, int64_t clock, const Px4Body& body);
  std::vector<Bytes> TakeOutgoing();
  /// What it asks of its inner loops.
  AttitudeSetpoint Demand(const Px4Body& body) const;

  void PilotMode(mavlink::Mode mode) { Enter(mode); }
  void PilotArms(bool on) { armed_ = on; }
  void PilotKills(bool on) { killed_ = on; }  ///< the kill switch
  void PilotSticks(double deflection);        ///< of the farthest, 0 to 1
  void Reboot(int64_t utime);
  Px4Options& options() { return options_; }

  bool armed() const { return armed_; }
  /// Does a cause of a failsafe last, whatever is done about it? PX4 1.14 counts a warning, and a
  /// pilot who has taken over, too.
  bool failsafe() const;
  mavlink::Mode mode() const { return mode_; }
  bool landed() const { return landed_; }
  int64_t Clock(int64_t utime) const;  ///< its own, microseconds
  /// The host's time of a stamp of whoever sends ODOMETRY, by TIMESYNC; none: not known yet.
  std::optional<int64_t> HostTime(uint64_t companion_us) const;

  /// What came in.
  struct Seen {
    int heartbeats = 0, setpoints = 0, odometry = 0, commands = 0, timesync = 0;
    int setpoints_while_not_offboard = 0;
    int times_armed = 0, offboard_commands = 0;
    double longest_setpoint_gap = 0.0;  ///< s between arrivals, armed and meant to fly OFFBOARD
    std::optional<mavlink::mav::SetAttitudeTarget> setpoint;
    std::optional<mavlink::mav::Odometry> vision;
    std::vector<double> clock_errors;  ///< s, of the host's clock as this side of TIMESYNC sees it
    std::map<uint32_t, double> rates;  ///< asked for since it began, Hz
  };
  const Seen& seen() const { return seen_; }

 private:
  void OnFrame(const mavlink::Frame& frame, int64_t arrival, int64_t clock);
  void OnSetpoint(const mavlink::mav::SetAttitudeTarget& message, int64_t arrival);
  using Sender = std::pair<uint8_t, uint8_t>;  // system, component
  static Sender SenderOf(const mavlink::Frame& frame) { return {frame.system, frame.component}; }
  void OnOdometry(mavlink::mav::Odometry m, Sender sender);
  void OnTimesync(const mavlink::mav::Timesync& m, Sender sender, int64_t arrival, int64_t clock);
  void OnCommand(const mavlink::mav::CommandLong& m, const mavlink::Frame& frame);
  uint8_t Handle(const mavlink::mav::CommandLong& m);
  uint8_t SetInterval(const mavlink::mav::CommandLong& m);
  uint8_t SendOnce(float id);
  uint8_t SetMode(std::optional<mavlink::Mode> mode);
  uint8_t Arm(bool on, bool forced);
  void Enter(mavlink::Mode mode, bool failsafe = false);
  bool Streamed() const;
  bool StreamAlive() const;
  /// One that does not hear its transmitter any more is told of still, without channels, as PX4IO
  /// does.
  bool HasReceiver() const { return options_.transmitter || transmitter_heard_; }
  /// Should it fly by setpoints? In the failsafe for their silence, too.
  bool IsLed() const { return armed_ && intended_ == mavlink::kOffboardMode; }
  void WatchHealth();
  std::string Health() const;
  void WatchStream();
  void WatchTransmitter();
  enum class Warning { kNone, kLow, kCritical, kEmergency };  // of battery_status
  Warning WarningAt(double charge) const;
  void WatchBattery();
  void WatchKill();
  void WatchLanding();
  AttitudeSetpoint OffboardDemand(const Px4Body& body) const;
  void Stream(int64_t clock);
  void StreamState();
  bool Due(uint32_t id);
  static const std::map<uint32_t, int64_t>& DefaultIntervals();
  template <class M>
  void Send(const M& message) {
    if (version_2_ || M::kId > 255)
      outgoing_.push_back(writer_.Write(now_, message));
    else
      outgoing_.push_back(InVersion1(M::kId, M::kBaseLength, mavlink::ToPayload(message)));
  }
  Bytes InVersion1(uint32_t id, std::size_t length, const mavlink::Payload& payload);
  void Say(const std::string& text, uint8_t severity);

  Px4Options options_;
  world::Random random_;
  mavlink::FrameReader reader_;
  mavlink::FrameWriter writer_{1, 1};
  uint8_t sequence_1_ = 0;
  bool version_2_;
  int64_t boot_, now_;
  struct Offset {
    int64_t us;       // their clock minus ours
    int answers = 0;  // that it is from
  };
  std::map<Sender, Offset> offsets_;  // of those who answer TIMESYNC
  Sender vision_sender_{};            // of the last ODOMETRY
  mavlink::Mode mode_, intended_;
  bool armed_ = false, landed_ = true, has_flown_ = false;
  Warning battery_warning_ = Warning::kNone;
  bool drained_ = false;      // it lands for its battery, or a pilot has taken over from that
  bool in_failsafe_ = false;  // the mode is a failsafe's, where it is not OFFBOARD
  bool silent_ = false;       // setpoints are, by which it is meant to fly
  bool killed_ = false;       // by the switch: the motors stand still in any mode
  bool unmanned_ = false;     // it flies and its transmitter is not heard any more
  std::optional<int64_t> transmitter_heard_;
  int64_t silent_since_ = 0;
  int64_t first_setpoint_ = 0, last_setpoint_ = 0;
  int64_t landed_since_, armed_since_, killed_since_;
  LandDetector land_detector_;
  std::optional<int64_t> flown_by_;  // arrival of the newest setpoint that it flew by
  std::string said_;                 // the check that fails, as last said
  Px4Body body_;
  OwnMode own_mode_{body_};
  std::map<uint32_t, int64_t> next_;       // of each stream
  std::set<uint32_t> asked_for_;           // once, not sent yet
  std::map<uint32_t, int64_t> intervals_;  // us; 0: none
  std::vector<Bytes> outgoing_;
  Seen seen_;
};

}  // namespace chase::simulator
