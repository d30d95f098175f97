#include "common/bus/command_call.h"

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
    client_.OnAnswer(ack.verdict == command_ack_t::ACCEPTED, ack.reason,
                     ack.verdict == command_ack_t::UNKNOWN);
}

double CommandCall::Elapsed() const { return Seconds(bus_->Now(), given_); }

world::CommandKey KeyOf(const command_t& m, int64_t origin) {
  return {m.sender, m.sender_start, m.id, Seconds(m.utime, origin)};
}

bool IsForced(const command_t& m) { return m.n_arguments == 1 && m.arguments[0] == 1.0; }

command_ack_t Acknowledgement(const command_t& m, const world::CommandAnswer& answer,
                              int64_t utime) {
  command_ack_t ack{};
  ack.utime = utime;
  ack.command_sender = m.sender;
  ack.command_start = m.sender_start;
  ack.id = m.id;
  ack.kind = m.kind;
  ack.verdict = answer.accepted  ? command_ack_t::ACCEPTED
                : answer.unknown ? command_ack_t::UNKNOWN
                                 : command_ack_t::REFUSED;
  ack.reason = answer.reason;
  return ack;
}

}  // namespace chase::bus
