#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/fcu/autopilot.h"
#include "services/fcu/clock_sync.h"
#include "services/fcu/conversions.h"
#include "services/fcu/fcu_config.h"
#include "services/fcu/handshake.h"
#include "services/fcu/imu_stream.h"
#include "services/fcu/stream_rates.h"
#include "services/fcu/touchdown.h"

namespace chase::fcu {

/// Between our messages and an autopilot's bytes. Knows no clock and no socket: bytes, messages and
/// times go in (microseconds of the host's clock, never back), bytes and samples come out.
class Bridge {
 public:
  using Bytes = std::vector<uint8_t>;

  explicit Bridge(const FcuConfig& config, const std::optional<Key>& key = std::nullopt);

  /// Bytes that arrived at `arrival` and are looked at `now`. `whole`: a datagram, in which no
  /// frame is left unfinished. `from`: its sender; while the autopilot is heard nobody else is.
  void Receive(int64_t arrival, int64_t now, const uint8_t* data, std::size_t size, bool whole,
               uint64_t from = 0);
  /// Whom the autopilot's heartbeat came from, before that whoever may be one: what goes out is for
  /// him. 0: nobody yet.
  uint64_t peer() const { return peer_; }
  void OnPose(const Pose& pose, int64_t now);
  /// `utime`: the message's own stamp. One that does not rise is a repetition and left out.
  void OnSetpoint(const Setpoint& setpoint, int64_t utime, int64_t now);
  /// Whoever leads the flights says where they are: `anew` on the ground and during a take-off,
  /// `wanted` where it takes off or leads about, and not where it waits, stops or comes down.
  void OnFlightState(bool anew, bool wanted) {
    led_ = true;
    anew_ = anew_ || anew;
    wanted_ = wanted;
  }
  /// As Handshake::Kill.
  void Kill() { handshake_.Kill(); }
  /// Whatever is due; to be called at twice the rate of setpoints or faster.
  void Tick(int64_t now);

  std::vector<Bytes> TakeOutgoing();
  std::vector<ImuSample> TakeImu();

  const Handshake& handshake() const { return handshake_; }
  const Autopilot& autopilot() const { return autopilot_; }
  const ClockSync& clock() const { return clock_; }
  const FrameReader& reader() const { return reader_; }
  const ImuStream& imu() const { return imu_; }
  const StreamRates& rates() const { return rates_; }
  /// Is a PX4 heard now?
  bool heard() const { return heard_; }
  /// What a flight waits for; empty: nothing.
  const std::string& missing() const { return missing_; }
  /// In flight, how the autopilot's attitude differs from POSE; empty: within the gate.
  const std::string& disagreement() const { return disagreement_; }
  /// All of it on one line.
  std::string Words() const;

 private:
  struct Heard {
    int64_t arrival, now;
    uint64_t from;
  };
  void OnFrame(const Frame& frame, const Heard& when);
  void OnTimesync(const mav::Timesync& m, const Heard& when);
  void AskForChecks(int64_t now);
  void AskTime(int64_t now);
  void SendSetpoint(int64_t now, bool by_rates = true);
  void Catch(int64_t now);
  void SendCommands(int64_t now);
  void SendHeartbeat(int64_t now);
  Facts Gather(int64_t now) const;
  std::string Missing(int64_t now) const;
  std::string PoseProblem(int64_t now) const;
  std::string AttitudeProblem(int64_t now) const;
  double PoseAge(int64_t now) const;
  bool Hears(int64_t now) const;
  void TakeFrame(int64_t now);
  bool IsFresh(int64_t now) const;

  template <class M>
  void Send(int64_t now, const M& message) {
    outgoing_.push_back(writer_.Write(now, message));
  }
  void Send(int64_t now, mav::CommandLong command, uint8_t system);
  void AskWho(const Frame& frame, const Heard& when);
  void AskWord(int64_t now, uint8_t system);

  FcuConfig config_;
  std::unique_ptr<Signing> signing_;
  FrameReader reader_;
  FrameWriter writer_;
  Autopilot autopilot_;
  ClockSync clock_;
  ImuStream imu_;
  StreamRates rates_;
  Touchdown touchdown_;
  Handshake handshake_;

  std::optional<Pose> pose_;
  int64_t pose_arrival_ = 0, next_odometry_ = 0;
  uint8_t resets_ = 0;
  std::optional<int32_t> frame_;  // epoch of the frame W that setpoints are in
  int64_t frame_since_ = 0;       // stamp of its first pose, until a setpoint in it has come
  double turn_ = 0.0;             // yaw of that W in the frame that the autopilot is told, rad
  bool framed_ = false;           // no other W has come that is not taken yet
  std::optional<Setpoint> setpoint_;
  int64_t setpoint_arrival_ = 0, setpoint_utime_ = 0, next_setpoint_ = 0;
  int64_t next_heartbeat_ = 0, next_timesync_ = 0, next_word_ = 0;
  std::deque<int64_t> time_requests_;  // sent, ns
  uint64_t peer_ = 0;
  bool heard_ = false;
  int restarts_ = 0;  // of the autopilot's clock
  // Answers to its TIMESYNC: taken by it since, given between our last two requests, and after them
  int time_answers_ = 0, answered_before_ = 0, answered_ = 0;
  int64_t ticked_ = 0;
  bool led_ = false;     // a mission is heard
  bool anew_ = false;    // it was on the ground or took off since the last flight's end
  bool wanted_ = false;  // it wants to be in the air
  std::string missing_ = "no PX4 is heard", disagreement_;
  int64_t setpoints_sent_ = 0, odometry_sent_ = 0;
  std::optional<int64_t> flown_by_;    // when the newest setpoint of this flight was sent
  double longest_setpoint_gap_ = 0.0;  // s between two of a flight
  std::vector<Bytes> outgoing_;
  std::vector<ImuSample> samples_;
};

}  // namespace chase::fcu
