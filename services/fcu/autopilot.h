#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "services/fcu/command.h"
#include "services/fcu/mavlink.h"
#include "services/fcu/status_text.h"

namespace chase::fcu {

/// What the autopilot has said of itself. Times: arrival, microseconds of the host's clock.
class Autopilot {
 public:
  /// `system`: whom to listen to; 0: the first PX4 whose heartbeat comes.
  explicit Autopilot(int system) : system_(static_cast<uint8_t>(system)) {}

  /// Takes a frame; false where it is not the autopilot's.
  bool Take(const Frame& frame, int64_t utime);

  /// Could the frame be its, which is not known yet?
  bool MayBe(const Frame& frame) const;
  bool known() const { return heartbeat_utime_ != 0; }
  uint8_t system() const { return system_; }
  /// Seconds since the last heartbeat.
  double silence(int64_t utime) const;
  int64_t heartbeat_utime() const { return heartbeat_utime_; }
  /// When the last frame of any kind came.
  int64_t frame_utime() const { return frame_utime_; }
  bool armed() const;
  /// A kill switch or a termination has stopped the motors, whatever the mode.
  bool terminated() const;
  /// CRITICAL, EMERGENCY or FLIGHT_TERMINATION.
  bool failsafe() const;
  Mode mode() const { return Mode::Of(heartbeat_.custom_mode); }
  /// By its own word, which must not be old.
  bool on_ground(int64_t utime) const;
  /// Why it cannot fly now by its own state (starting, calibrating, in a failsafe ...); empty: it
  /// can.
  std::string Unfit() const;
  /// What else speaks on the link in an autopilot's place, since it last did; empty: nobody.
  const std::string& stranger() const { return stranger_; }

  struct Attitude {
    int64_t utime;
    Eigen::Quaterniond R_WB;
  };
  const std::optional<Attitude>& attitude() const { return attitude_; }
  /// p_WB by its own estimate, m.
  const std::optional<Eigen::Vector3d>& position() const { return position_; }

  /// The first texts of severity warning or worse that were last said together, the first of them
  /// no longer than `seconds` ago, and the checks of which it has said that they fail since it was
  /// last armed, of whatever age.
  std::string Warning(int64_t utime, double seconds) const;
  /// Mode, battery, landed state, receiver in a few words, which bus::FcuState reads.
  std::string Words(int64_t utime) const;

 private:
  struct Battery {
    int percent = -1;    // unknown
    double volts = 0.0;  // 0: unknown
    int64_t utime = 0;   // when it was told
  };
  mav::MavLandedState Landed(int64_t utime) const;
  const Battery* Emptiest(int64_t utime) const;
  bool TakeHeartbeat(const Frame& frame, int64_t utime);
  void TakeState(const Frame& frame, int64_t utime);
  void TakeText(const StatusText& text, int64_t utime);

  uint8_t system_;
  mav::Heartbeat heartbeat_;
  int64_t heartbeat_utime_ = 0, frame_utime_ = 0;
  uint8_t landed_ = 0;
  int64_t landed_utime_ = 0;  // when it said so
  std::optional<Attitude> attitude_;
  std::optional<Eigen::Vector3d> position_;
  Battery battery_;                       // of SYS_STATUS: the emptiest of those that are connected
  std::map<uint8_t, Battery> batteries_;  // of BATTERY_STATUS
  int channels_ = 0;                      // of its receiver
  int64_t channels_utime_ = 0;
  StatusTexts texts_;
  std::deque<std::string> warnings_;       // that were said together, the first said is first
  int64_t warned_utime_ = 0;               // when the first of them was said
  std::deque<std::string> failed_checks_;  // the last said is last
  std::string stranger_;
};

}  // namespace chase::fcu
