#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/lidar/config.h"
#include "services/lidar/model_check.h"
#include "services/lidar/vlp16.h"

namespace chase::lidar {

/// One turn of the sensor. Points are in firing order; their t counts from `device_us`.
struct Sweep {
  int64_t device_us = 0;   ///< start of the sweep on the sensor's clock, without its hourly wrap
  double covered_deg = 0;  ///< azimuth between the first and the last firing
  std::vector<Point> points;
};

/// Cuts the stream of packets into whole turns. What comes before the first cut is left out, and so
/// is a turn that the end of the stream breaks off.
class SweepAssembler {
 public:
  explicit SweepAssembler(const LidarConfig& config) : config_(config) {}

  /// Takes one packet; what is malformed is counted and left out. Returns the sweeps completed by
  /// it: at most one from a turning sensor.
  std::vector<Sweep> Add(const uint8_t* data, size_t size);

  /// The turn in progress if it is whole but for its last 5 degrees; else nothing, and the turn is
  /// counted as broken off.
  std::optional<Sweep> Finish();

  /// Time of a packet on the sensor's clock without its hourly wrap, microseconds. Packets are to
  /// be given in order.
  int64_t Unwrap(uint32_t stamp_us);

  const ModelCheck& model() const { return model_; }
  long malformed() const { return malformed_; }
  long lost() const { return lost_; }
  long broken_off() const { return broken_off_; }

 private:
  using Bytes = std::array<uint8_t, kPacketBytes>;

  void AddPacket(const uint8_t* data, std::vector<Sweep>* done);
  void CountLost(int64_t stamp_us, double interval_us);
  void AddFiring(const Packet& packet, const Firing& firing, int64_t stamp_us,
                 std::vector<Sweep>* done);
  double Turned(double azimuth_deg);
  void Begin(int64_t stamp_us, const Firing& firing);

  LidarConfig config_;
  ModelCheck model_;
  std::vector<Bytes> waiting_;  // until the model is known
  long malformed_ = 0, lost_ = 0, broken_off_ = 0;
  int64_t hours_us_ = 0;
  std::optional<uint32_t> last_raw_us_;
  std::optional<int64_t> last_stamp_us_;
  std::optional<double> cut_deg_, last_turned_;
  std::optional<Sweep> sweep_;
  double start_turned_ = 0;
};

}  // namespace chase::lidar
