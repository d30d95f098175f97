#include "services/lidar/lidar_node.h"

#include <fmt/format.h>

#include "common/bus/convert.h"
#include "common/bus/host_clock.h"
#include "services/lidar/convert.h"

namespace chase::lidar {
namespace {

constexpr int64_t kOldest = 1'000'000;  // us that a packet may wait in the socket
constexpr double kSilent = 0.2;         // s without a packet: 150 are missing
constexpr double kPatience = 2.0;       // s without one since the start
constexpr double kFlawed = 5.0;         // s after a loss in which the sensor is called degraded

}  // namespace

LidarNode::LidarNode(bus::Bus& bus, const LidarConfig& config)
    : bus_(bus),
      port_(config.port),
      assembler_(config),
      clock_(config),
      source_(OpenPacketSource(config.source, config.port)) {
  if (config.clock == "gps" && !source_->IsRecording())
    positions_ = OpenPacketSource("udp", config.position_port);
}

void LidarNode::Tick(int64_t utime) {
  if (done_) return;
  if (source_->IsRecording())
    TickRecording(utime);
  else
    TickDevice();
  StopIfRefused();
}

void LidarNode::TickDevice() {
  if (!first_tick_) first_tick_ = bus_.Now();
  while (const auto packet = source_->Next()) {
    const uint8_t* data = packet->bytes.data();
    // The stamp is of the first firing; the packet leaves after its last.
    if (PacketProblem(data, packet->bytes.size()).empty()) {
      heard_ = bus_.Now();
      alignment_.Add(clock_.Unwrap(PacketStamp(data)) + PacketDuration(data), Arrival(*packet));
    }
    Take(*packet);
  }
  const long flaws = assembler_.lost() + assembler_.malformed();
  if (flaws != flaws_) flawed_ = bus_.Now();
  flaws_ = flaws;
}

/// On the bus's clock.
int64_t LidarNode::SweepTime(int64_t device_us) {
  const int64_t aligned = alignment_.HostTime(device_us);
  if (!positions_) return aligned;
  const int64_t wall = bus::WallMicroseconds(), now = bus_.Now();
  while (const auto packet = positions_->Next())
    gps_.Hear(packet->bytes.data(), packet->bytes.size(), wall);
  const auto utc = gps_.Utc(device_us, wall - (now - aligned));
  gps_problem_ = utc ? "" : gps_.Problem(wall);
  return utc ? now - (wall - *utc) : aligned;
}

/// On the bus's clock, which the wall clock may have left since. Where that was set while packets
/// waited, they may be stamped by what it was before.
int64_t LidarNode::Arrival(const RawPacket& packet) {
  const int64_t age = bus::WallMicroseconds() - packet.capture_utime;
  const bool is_known =
      packet.capture_utime > 0 && age >= 0 && age < kOldest && !wall_.WasSet(kOldest);
  return bus_.Now() - (is_known ? age : 0);
}

/// s since the last packet that is one, or since the start.
double LidarNode::Silence() const {
  return bus::Seconds(bus_.Now(), heard_ != 0 ? heard_ : first_tick_.value_or(bus_.Now()));
}

void LidarNode::TickRecording(int64_t utime) {
  if (!first_tick_) first_tick_ = utime;
  while (next_ || (next_ = source_->Next())) {
    if (PacketProblem(next_->bytes.data(), next_->bytes.size()).empty()) {
      const int64_t device_us = clock_.Unwrap(PacketStamp(next_->bytes.data()));
      if (!first_device_us_) {
        first_device_us_ = device_us;
        alignment_.Add(device_us, utime);
      }
      if (device_us - *first_device_us_ > utime - *first_tick_) return;
    }
    Take(*next_);
    next_.reset();
  }
  if (const auto last = assembler_.Finish()) Publish(*last);
  done_ = true;
}

void LidarNode::Take(const RawPacket& packet) {
  std::vector<Sweep> sweeps;
  {
    auto timer = bus_.Time("decode");
    sweeps = assembler_.Add(packet.bytes.data(), packet.bytes.size());
  }
  for (const Sweep& sweep : sweeps) Publish(sweep);
}

void LidarNode::Publish(const Sweep& sweep) {
  bus_.Publish("LIDAR_SCAN", ToMessage(sweep, SweepTime(sweep.device_us)));
  ++sweeps_;
}

void LidarNode::StopIfRefused() {
  if (assembler_.model().verdict() != ModelCheck::Verdict::kOther) return;
  bus_.ReportError(Refusal());
  if (source_->IsRecording()) done_ = true;
}

/// The verdict is for good: a sensor that is exchanged is not looked at.
std::string LidarNode::Refusal() const {
  const std::string& reason = assembler_.model().reason();
  if (source_->IsRecording()) return reason;
  return reason +
         "; connect a VLP-16, then start this process anew (systemctl restart chase-lidar)";
}

bus::NodeReport LidarNode::Report() const {
  using State = bus::NodeReport::State;
  if (assembler_.model().verdict() == ModelCheck::Verdict::kOther)
    return {State::kFailed, Refusal()};
  const bool device = !source_->IsRecording();
  if (device && Silence() > (heard_ != 0 ? kSilent : kPatience))
    return {State::kFailed,
            fmt::format("no packet for {:.1f} s, {} malformed; check the sensor's power and cable, "
                        "and its page: it sends to this computer's address, port {}",
                        Silence(), assembler_.malformed(), port_)};
  if (sweeps_ == 0) return {State::kStarting, "no whole sweep yet"};
  const bool flawed = device ? flawed_ != 0 && bus::Seconds(bus_.Now(), flawed_) < kFlawed
                             : assembler_.lost() + assembler_.malformed() > 0;
  const std::string clock = gps_problem_.empty() ? "" : "; stamps by arrival: " + gps_problem_;
  return {flawed || !clock.empty() ? State::kDegraded : State::kOk,
          fmt::format("{} sweeps, {} packets lost, {} malformed{}", sweeps_, assembler_.lost(),
                      assembler_.malformed(), clock)};
}

}  // namespace chase::lidar
