#include "deploy/flight/operator.h"

#include "common/bus/convert.h"

namespace chase::flight {

Operator::Operator(bus::Bus& bus, const std::vector<world::CommandSpec>& commands,
                   int64_t mission_start)
    : bus_(bus), commands_(commands), mission_start_(mission_start) {
  bus_.Subscribe<command_ack_t>("COMMAND_ACK", [this](const command_ack_t& m) {
    if (call_) call_->Hear(m);
  });
}

void Operator::Tick(int64_t utime) {
  if (static_cast<size_t>(id_) >= commands_.size()) return;
  const world::CommandSpec& next = commands_[static_cast<size_t>(id_)];
  if (!call_ && bus::Seconds(utime, mission_start_) >= next.at_s)
    call_.emplace(bus_, *world::CommandNamed(next.command), id_,
                  next.command == "kill" ? std::vector<double>{1.0} : next.at_px);
  if (!call_) return;
  call_->Turn();
  if (!call_->IsDone() && !call_->GaveUp()) return;
  if (!call_->accepted())
    bus_.ReportError(next.command + (call_->answered() ? ": " + call_->reason() : ": no answer"));
  call_.reset();
  ++id_;
}

}  // namespace chase::flight
