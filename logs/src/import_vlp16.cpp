#include <optional>
#include <stdexcept>

#include "logs/src/import.h"
#include "logs/src/output.h"
#include "services/lidar/convert.h"
#include "services/lidar/packet_source.h"
#include "services/lidar/sweep_assembler.h"

namespace chase::logs {
namespace {

class Vlp16Import {
 public:
  explicit Vlp16Import(const std::string& out) : log_(out) {}

  int Run(const std::string& file, const lidar::LidarConfig& config) {
    lidar::SweepAssembler assembler(config), clock(config);
    const auto source = lidar::OpenPacketSource(file, config.port);
    while (const auto packet = source->Next()) {
      const auto& bytes = packet->bytes;
      if (!offset_us_ && lidar::PacketProblem(bytes.data(), bytes.size()).empty())
        offset_us_ = packet->capture_utime == 0
                         ? 0
                         : packet->capture_utime - clock.Unwrap(lidar::PacketStamp(bytes.data()));
      for (const auto& sweep : assembler.Add(bytes.data(), bytes.size())) Write(sweep);
      if (assembler.model().verdict() == lidar::ModelCheck::Verdict::kOther)
        throw std::runtime_error(file + ": refused: " + assembler.model().reason());
    }
    if (const auto last = assembler.Finish()) Write(*last);
    if (sweeps_ == 0) throw std::runtime_error(file + ": holds no whole turn of a VLP-16");
    log_.Close();
    return sweeps_;
  }

 private:
  void Write(const lidar::Sweep& sweep) {
    auto scan = lidar::ToMessage(sweep, sweep.device_us + offset_us_.value_or(0));
    scan.seq = sweeps_++;
    log_.Write(scan.utime + kSweepUs, "LIDAR_SCAN", scan);
  }

  static constexpr int64_t kSweepUs = 100'000;
  OutputLog log_;
  std::optional<int64_t> offset_us_;
  int sweeps_ = 0;
};

}  // namespace

int ImportVlp16(const std::string& file, const std::string& out) {
  lidar::LidarConfig config;
  config.cut_azimuth_deg = -1.0;
  if (file == "udp") throw std::runtime_error("udp: is no recording; run chase-lidar instead");
  return Vlp16Import(out).Run(file, config);
}

}  // namespace chase::logs
