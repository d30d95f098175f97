#include "common/bus/command_call.h"

#include "chase/command_t.hpp"
#include "common/bus/convert.h"

namespace chase::bus {

void CommandCall::Turn() {
  if (!client_.Due(Elapsed())) return;
  command_t m{};
  m.utime = given_;
  m.id = id_;
  m.kind = static_cast<int8_t>(client_.command());
  m.arguments = arguments_;
  m.n_arguments = static_cast<int32_t>(m.arguments.size());
  bus_->Publish("COMMAND", m);
}

void CommandCall::Hear(const command_ack_t& ack) {
  const Identity& self = bus_->identity();
  if (ack.command_sender == self.process && ack.command_start == self.start && ack.id == id_)
    client_.OnAnswer(ack.verdict == command_ack_t::ACCEPTED, ack.reason);
}

double CommandCall::Elapsed() const { return Seconds(bus_->Now(), given_); }

}  // namespace chase::bus
