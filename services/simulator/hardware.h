#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "services/simulator/mavlink_peer.h"
#include "services/simulator/mjpeg_server.h"
#include "services/simulator/simulator.h"
#include "services/simulator/udp_socket.h"

namespace chase::simulator {

/// The devices of the vehicle as drivers meet them. Times: microseconds, `utime` of the simulation,
/// `clock` of the host.
class Hardware {
 public:
  /// Throws std::runtime_error when a port cannot be had. `utime`: power-on.
  Hardware(const SimulatorConfig& config, int64_t utime);

  /// Before a step that begins at `t`, s after power-on.
  void Steer(int64_t clock, double t, Simulator* simulator);
  /// After it: what was measured leaves.
  void Tell(int64_t utime, int64_t clock, const Simulator& simulator, const ImuSample& imu);
  /// The LiDAR's data packets, and a position packet each second. `power_on` and `clock`, now, of
  /// the host; `clock_error`: what the sensor's clock is off by, s.
  void SendPackets(std::vector<DataPacket> packets, int64_t power_on, int64_t clock,
                   double clock_error);
  void SendImage(const Image& image, int64_t utime, int64_t clock);

  std::string Words() const { return peer_ ? peer_->Words() : ""; }

 private:
  std::unique_ptr<MavlinkPeer> peer_;
  std::unique_ptr<UdpSocket> lidar_, positions_;
  bool gps_;
  std::optional<int64_t> lidar_boot_;  // its clock at power-on, us
  double next_position_ = 0.0;         // s after power-on
  std::unique_ptr<MjpegServer> camera_;
};

}  // namespace chase::simulator
