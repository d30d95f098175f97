#pragma once

#include <memory>
#include <optional>

#include "common/bus/bus.h"
#include "common/bus/host_clock.h"
#include "common/bus/node.h"
#include "common/math/clock_alignment.h"
#include "services/lidar/config.h"
#include "services/lidar/gps_clock.h"
#include "services/lidar/packet_source.h"
#include "services/lidar/sweep_assembler.h"

namespace chase::lidar {

/// Publishes each whole sweep as LIDAR_SCAN. A recording plays at its own pace from the first tick.
class LidarNode : public bus::Node {
 public:
  LidarNode(bus::Bus& bus, const LidarConfig& config);

  int64_t TickPeriod() const override { return 10'000; }
  void Tick(int64_t utime) override;
  bool Done() const override { return done_; }
  bus::NodeReport Report() const override;

 private:
  void TickDevice();
  int64_t SweepTime(int64_t device_us);
  int64_t Arrival(const RawPacket& packet);
  double Silence() const;
  void TickRecording(int64_t utime);
  void Take(const RawPacket& packet);
  void Publish(const Sweep& sweep);
  void StopIfRefused();
  std::string Refusal() const;

  bus::Bus& bus_;
  int port_;
  SweepAssembler assembler_;
  SweepAssembler clock_;  // only unwraps the stamps of packets that wait for their time
  std::unique_ptr<PacketSource> source_;
  std::unique_ptr<PacketSource> positions_;  // with the clock gps
  GpsClock gps_;
  std::string gps_problem_;  // why the last sweep is not stamped by it
  // us; chosen, not measured: above what delays on a wire vary by, as fcu's ClockSync has it.
  static constexpr int64_t kLate = 20'000;
  math::ClockAlignment alignment_{kLate};
  bus::WallClockWatch wall_;
  std::optional<RawPacket> next_;
  std::optional<int64_t> first_tick_, first_device_us_;
  int64_t heard_ = 0;   // when the last packet came that is one, bus's clock; 0: none yet
  int64_t flawed_ = 0;  // when one was last lost or malformed
  long flaws_ = 0;      // lost and malformed until then
  long sweeps_ = 0;
  bool done_ = false;
};

}  // namespace chase::lidar
