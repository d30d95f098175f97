#include "services/simulator/hardware.h"

#include <cmath>

#include "common/bus/host_clock.h"

namespace chase::simulator {
namespace {

// The sensor counts from its own power-on, as without a GPS.
constexpr int64_t kLidarBoot = 3'590'000'000;  // us past the hour: it wraps 10 s later

}  // namespace

Hardware::Hardware(const SimulatorConfig& config, int64_t utime) {
  const HardwareConfig& h = config.hardware;
  if (h.mavlink()) peer_ = std::make_unique<MavlinkPeer>(config, utime);
  if (h.packets()) lidar_ = std::make_unique<UdpSocket>(h.host, h.lidar_port, 0);
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

void Hardware::SendPackets(std::vector<DataPacket> packets, double clock_error) {
  if (!lidar_) return;
  for (DataPacket& packet : packets) {
    packet.SetStamp(kLidarBoot + std::llround(1e6 * (packet.start + clock_error)));
    lidar_->Send(packet.bytes.data(), packet.bytes.size());
  }
}

void Hardware::SendImage(const Image& image, int64_t utime, int64_t clock) {
  if (camera_) camera_->Send(image, bus::WallMicroseconds() - (clock - utime));
}

}  // namespace chase::simulator
