#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/world/random.h"
#include "services/fcu/command.h"
#include "services/fcu/framing.h"

namespace chase::fcu::testing {

/// The parameters of PX4 that the rules below go by, and what a test may break.
struct StandInOptions {
  double com_of_loss_t = 1.0;    ///< s without setpoints until OFFBOARD is left
  double com_disarm_land = 2.0;  ///< s on the ground after landing until it disarms
  bool loss_lands = true;        ///< COM_OBL_RC_ACT: land, otherwise hold
  double hover = 0.5;            ///< MPC_THR_HOVER
  double lost_acks = 0.0;        ///< probability
  bool starts_in_version_1 = true;
  double drift_ppm = 30.0;                                ///< of its clock
  std::string preflight;                                  ///< a check that fails; empty: none
  bool refuses_offboard = false, refuses_to_arm = false;  ///< with DENIED
  int autopilot = 12;
};

/// A stand-in for PX4: what its documents say of OFFBOARD, arming, failsafes, streams and clocks
/// (docs.px4.io: Offboard Mode, Safety; mavlink.io: Command, Timesync), and a body that is a point
/// with an attitude lag. No model of its estimator: it tells the truth. Times are of the host,
/// microseconds; the autopilot's own clock began kBoot before the first one.
class StandIn {
 public:
  using Bytes = std::vector<uint8_t>;

  StandIn(const StandInOptions& options, int64_t utime, uint64_t seed);

  void Receive(int64_t utime, const Bytes& bytes);
  /// Moves the body on and sends what is due; to be called at 200 Hz or faster.
  void Tick(int64_t utime);
  std::vector<Bytes> TakeOutgoing();

  void PilotMode(Mode mode);
  void PilotArms(bool on) { armed_ = on; }
  void Reboot(int64_t utime);
  StandInOptions& options() { return options_; }

  bool armed() const { return armed_; }
  bool failsafe() const { return failsafe_; }
  Mode mode() const { return mode_; }
  bool landed() const { return landed_; }
  const Eigen::Vector3d& p_WB() const { return p_; }
  const Eigen::Vector3d& v_WB() const { return v_; }
  const Eigen::Quaterniond& R_WB() const { return R_; }
  int64_t Clock(int64_t utime) const;  ///< its own, microseconds

  /// What came in, for tests to judge.
  struct Seen {
    int heartbeats = 0, setpoints = 0, odometry = 0, commands = 0, timesync = 0;
    int setpoints_while_not_offboard = 0;
    int times_armed = 0, offboard_commands = 0;
    std::optional<mav::SetAttitudeTarget> setpoint;
    std::optional<mav::Odometry> vision;
    std::vector<double> clock_errors;  ///< s, of the host's clock as our side of TIMESYNC sees it
    std::map<uint32_t, double> rates;  ///< asked for, Hz
  };
  const Seen& seen() const { return seen_; }

 private:
  void OnFrame(const Frame& frame);
  void OnCommand(const mav::CommandLong& m, uint8_t from_system, uint8_t from_component);
  uint8_t Handle(const mav::CommandLong& m);
  uint8_t SetMode(Mode mode);
  uint8_t Arm(bool on);
  bool Streamed() const;
  bool StreamAlive() const;
  void Rules();
  void Move(double dt);
  void Stream();
  template <class M>
  void Send(const M& message);
  void Say(const std::string& text, uint8_t severity);

  StandInOptions options_;
  world::Random random_;
  FrameReader reader_;
  FrameWriter writer_{1, 1};
  uint8_t sequence_1_ = 0;
  bool version_2_;
  int64_t boot_, now_, last_tick_;
  Mode mode_{3, 0}, intended_{3, 0};
  bool armed_ = false, failsafe_ = false, landed_ = true;
  int64_t first_setpoint_ = 0, last_setpoint_ = 0, landed_since_ = 0, down_since_ = 0;
  bool has_flown_ = false;
  Eigen::Vector3d p_ = Eigen::Vector3d::Zero(), v_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_ = Eigen::Vector3d::Zero(), force_ = {0, 0, 9.81};
  Eigen::Quaterniond R_ = Eigen::Quaterniond::Identity();
  std::map<uint32_t, int64_t> next_;       // of each stream
  std::map<uint32_t, int64_t> intervals_;  // us
  std::vector<Bytes> outgoing_;
  Seen seen_;
};

}  // namespace chase::fcu::testing
