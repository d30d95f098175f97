#include "services/lidar/lidar_node.h"

#include "services/lidar/convert.h"

namespace chase::lidar {

LidarNode::LidarNode(bus::Bus& bus, const LidarConfig& config)
    : bus_(bus),
      assembler_(config),
      clock_(config),
      source_(OpenPacketSource(config.source, config.port)) {}

void LidarNode::Tick(int64_t utime) {
  if (done_) return;
  if (source_->IsRecording())
    TickRecording(utime);
  else
    TickDevice(utime);
  StopIfRefused();
}

void LidarNode::TickDevice(int64_t utime) {
  while (const auto packet = source_->Next()) {
    if (PacketProblem(packet->bytes.data(), packet->bytes.size()).empty())
      alignment_.Add(clock_.Unwrap(PacketStamp(packet->bytes.data())), utime);
    Take(*packet);
  }
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
  bus_.Publish("LIDAR_SCAN", ToMessage(sweep, alignment_.HostTime(sweep.device_us)));
  ++sweeps_;
}

void LidarNode::StopIfRefused() {
  if (assembler_.model().verdict() != ModelCheck::Verdict::kOther) return;
  bus_.ReportError(assembler_.model().reason());
  if (source_->IsRecording()) done_ = true;
}

bus::NodeReport LidarNode::Report() const {
  using State = bus::NodeReport::State;
  if (assembler_.model().verdict() == ModelCheck::Verdict::kOther)
    return {State::kFailed, assembler_.model().reason()};
  if (sweeps_ == 0) return {State::kStarting, "no whole sweep yet"};
  const std::string detail = std::to_string(sweeps_) + " sweeps, " +
                             std::to_string(assembler_.lost()) + " packets lost, " +
                             std::to_string(assembler_.malformed()) + " malformed";
  return {assembler_.lost() + assembler_.malformed() > 0 ? State::kDegraded : State::kOk, detail};
}

}  // namespace chase::lidar
