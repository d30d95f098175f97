#include "services/simulator/hardware.h"

#include <cmath>

#include "common/bus/host_clock.h"
#include "services/simulator/position_packet.h"

namespace chase::simulator {
namespace {

// Without a GPS the sensor counts from its own power-on.
constexpr int64_t kLidarBoot = 3'590'000'000;  // us past the hour: it wraps 10 s later

}  // namespace

Hardware::Hardware(const SimulatorConfig& config, int64_t utime)
    : gps_(config.hardware.lidar_clock == "gps") {
  const HardwareConfig& h = config.hardware;
  if (h.mavlink()) peer_ = std::make_unique<MavlinkPeer>(config, utime);
  if (h.packets()) {
    lidar_ = std::make_unique<UdpSocket>(h.host, h.lidar_port, 0);
    positions_ = std::make_unique<UdpSocket>(h.host, h.position_port, 0);
  }
  if (h.stream()) camera_ = std::make_unique<MjpegServer>(h.camera_port, h.jpeg_quality);
}

void Hardware::Steer(int64_t clock, double t, Simulator* simulator) {
  if (peer_) peer_->Steer(clock, t, simulator);
}

void Hardware::Tell(int64_t utime, int64_t clock, const Simulator& simulator,
                    const ImuSample& imu) {
  if (peer_) peer_->Tell(utime, clock, simulator, imu);
  if (camera_) camera_->Tick();
}

void Hardware::SendPackets(std::vector<DataPacket> packets, int64_t power_on, int64_t clock,
                           double clock_error) {
  if (!lidar_) return;
  // Once: two clocks read one after the other would make the stamps uneven.
  if (!lidar_boot_) lidar_boot_ = gps_ ? bus::WallMicroseconds() - (clock - power_on) : kLidarBoot;
  for (DataPacket& packet : packets) {
    const int64_t stamp = *lidar_boot_ + std::llround(1e6 * (packet.start + clock_error));
    packet.SetStamp(stamp);
    lidar_->Send(packet.bytes.data(), packet.bytes.size());
    if (packet.start < next_position_) continue;
    next_position_ = packet.start + 1.0;
    const auto position = PositionPacket(stamp, gps_);
    positions_->Send(position.data(), position.size());
  }
}

void Hardware::SendImage(const Image& image, int64_t utime, int64_t clock) {
  if (camera_) camera_->Send(image, bus::WallMicroseconds() - (clock - utime));
}

}  // namespace chase::simulator
