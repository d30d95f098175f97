#include "deploy/flight/operator.h"

#include "chase/command_t.hpp"
#include "common/bus/convert.h"

namespace chase::flight {

Operator::Operator(bus::Bus& bus, const std::vector<world::CommandSpec>& commands,
                   int64_t mission_start)
    : bus_(bus), commands_(commands), mission_start_(mission_start) {
  bus_.Subscribe<command_ack_t>("COMMAND_ACK", [this](const command_ack_t& m) { OnAnswer(m); });
}

void Operator::Tick(int64_t utime) {
  if (static_cast<size_t>(id_) >= commands_.size()) return;
  const world::CommandSpec& next = commands_[static_cast<size_t>(id_)];
  const double t = bus::Seconds(utime, mission_start_);
  if (!client_ && t >= next.at_s) {
    client_.emplace(*mission::CommandNamed(next.command), t);
    given_ = utime;
  }
  if (!client_) return;
  if (client_->Due(t)) {
    command_t m{};
    m.utime = given_;
    m.id = id_;
    m.kind = static_cast<int8_t>(client_->command());
    bus_.Publish("COMMAND", m);
  } else if (client_->answered() || client_->GaveUp(t)) {
    if (!client_->accepted())
      bus_.ReportError(next.command +
                       (client_->answered() ? ": " + client_->reason() : ": no answer"));
    client_.reset();
    ++id_;
  }
}

void Operator::OnAnswer(const command_ack_t& message) {
  if (client_ && message.command_sender == bus_.identity().process &&
      message.command_start == bus_.identity().start && message.id == id_)
    client_->OnAnswer(message.verdict == command_ack_t::ACCEPTED, message.reason);
}

}  // namespace chase::flight
