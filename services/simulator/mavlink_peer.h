#pragma once

#include <cstdint>

#include "services/simulator/px4.h"
#include "services/simulator/simulator.h"
#include "services/simulator/udp_socket.h"

namespace chase::simulator {

/// The simulated vehicle behind an autopilot that speaks MAVLink over UDP. Times: microseconds,
/// `utime` of the simulation, `clock` of the host, which a busy simulation lags behind.
class MavlinkPeer {
 public:
  MavlinkPeer(const SimulatorConfig& config, int64_t utime);

  /// Hears the companion and hands the inner loops what the autopilot asks of them, at t [s].
  void Steer(int64_t clock, double t, Simulator* simulator);
  /// Tells of the vehicle after a step.
  void Tell(int64_t utime, int64_t clock, const Simulator& simulator, const ImuSample& imu);

  /// Mode, arming and the longest gap between setpoints in words.
  std::string Words() const;

 private:
  void FollowVision(Estimator* estimator);

  Px4 px4_;
  UdpSocket socket_;
  int poses_ = 0;
};

}  // namespace chase::simulator
