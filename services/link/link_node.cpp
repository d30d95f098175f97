#include "services/link/link_node.h"

#include <fmt/format.h>

#include <stdexcept>

#include "common/bus/channels.h"
#include "common/bus/convert.h"

namespace chase::link {
namespace {

constexpr int64_t kIdle = 500'000;       // us without a message after which the peer is told of us
constexpr int64_t kSilence = 3'000'000;  // us after which the peer is gone
constexpr int kMostTaken = 500;          // packets a tick, so that a flood does not hold it
constexpr char kCommand[] = "COMMAND";

const LinkConfig& Checked(const LinkConfig& config) {
  const std::string problem = config.Problem();
  if (!problem.empty()) throw std::runtime_error(problem);
  return config;
}

}  // namespace

bool Leaves(const std::string& channel, bool vehicle) {
  if (!vehicle) return channel == kCommand;
  return channel != kCommand && channel != bus::StatusChannel("link") && !bus::IsHeavy(channel);
}

LinkNode::LinkNode(bus::Bus& bus, const LinkConfig& config)
    : bus_(bus),
      config_(Checked(config)),
      seal_(bus::LoadSeal(config.key_file)),
      socket_(config.port, config.peer),
      packer_(bus.Now()) {
  bus_.SubscribeEvery([this](const std::string& channel, int64_t /*utime*/, const uint8_t* data,
                             size_t size) { OnMessage(channel, data, size); });
}

void LinkNode::OnMessage(const std::string& channel, const uint8_t* data, size_t size) {
  const std::string name = channel.substr(bus_.identity().vehicle.size());
  if (!socket_.has_peer() || !Leaves(name, config_.is_vehicle()) || !Due(name)) return;
  if (packer_.Add(name, data, size))
    ++n_out_;
  else
    bus_.ReportError(fmt::format("{}: {} bytes are too many for the link", name, size));
}

bool LinkNode::Due(const std::string& channel) {
  if (config_.most_rate_hz <= 0.0) return true;
  int64_t& last = sent_[channel];
  if (bus::Seconds(bus_.Now(), last) < 1.0 / config_.most_rate_hz) return false;
  last = bus_.Now();
  return true;
}

void LinkNode::Tick(int64_t /*utime*/) {
  TakeIn();
  SendOut();
}

void LinkNode::TakeIn() {
  for (int i = 0; i < kMostTaken; ++i) {
    const auto packet = socket_.Next();
    if (!packet) return;
    if (packet->empty()) continue;
    const auto size =
        seal_.Open(config_.is_vehicle() ? "ground" : "vehicle", packet->data(), packet->size());
    std::vector<Message> messages;
    // Without a key a peer has to be named.
    if (!size || (!seal_.on() && config_.peer.empty()) ||
        !unpacker_.Take(packet->data(), *size, &messages)) {
      ++n_refused_;
      continue;
    }
    // Whoever recorded a packet may send it again from elsewhere.
    if (unpacker_.advanced()) {
      socket_.Trust();
      last_heard_ = bus_.Now();
    }
    packer_.Hear(unpacker_);
    for (Message& m : messages) {
      if (!Leaves(m.channel, !config_.is_vehicle())) {
        ++n_refused_;
        bus_.ReportError(m.channel + ": came over the link and may not");
        continue;
      }
      ++n_in_;
      bus_.Forward(m.channel, std::move(m.bytes));
    }
  }
}

void LinkNode::SendOut() {
  const bool idle = bus_.Now() - last_sent_ >= kIdle;
  for (Bytes& packet : packer_.Take(idle)) {
    seal_.Close(config_.is_vehicle() ? "vehicle" : "ground", &packet);
    bytes_out_ += static_cast<int64_t>(packet.size());
    socket_.Send(packet);
    last_sent_ = bus_.Now();
  }
}

bus::NodeReport LinkNode::Report() const {
  using State = bus::NodeReport::State;
  const std::string counts =
      fmt::format("{} messages out in {:.1f} MB, {} in; {} of {} packets lost, {} refused", n_out_,
                  1e-6 * static_cast<double>(bytes_out_), n_in_, unpacker_.lost(),
                  unpacker_.lost() + unpacker_.packets(), n_refused_ + socket_.strangers());
  if (last_heard_ == 0) return {State::kStarting, "nobody at the other end yet; " + counts};
  if (bus_.Now() - last_heard_ > kSilence)
    return {State::kDegraded, fmt::format("the other end is silent for {:.0f} s; ",
                                          bus::Seconds(bus_.Now(), last_heard_)) +
                                  counts};
  return {State::kOk, counts};
}

}  // namespace chase::link
