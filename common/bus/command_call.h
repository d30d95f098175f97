#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "chase/command_ack_t.hpp"
#include "chase/command_t.hpp"
#include "common/bus/bus.h"
#include "common/world/command_window.h"
#include "common/world/commands.h"

namespace chase::bus {

/// A command on its way over the bus: COMMAND until a COMMAND_ACK names it.
class CommandCall {
 public:
  /// Given now. `kind`: one of command_t's constants; `id`: no other command of this process has
  /// it; `arguments`: as command_t says of the kind.
  CommandCall(Bus& bus, int kind, int64_t id, std::vector<double> arguments = {})
      : bus_(&bus),
        given_(bus.Now()),
        id_(id),
        arguments_(std::move(arguments)),
        client_(kind, 0.0) {}

  /// Sends it when that is due: to be called ten times a second or more.
  void Turn();
  /// Of all acknowledgements; what answers another command is left alone.
  void Hear(const command_ack_t& ack);

  bool answered() const { return client_.answered(); }
  bool IsDone() const { return client_.IsDone(Elapsed()); }
  bool GaveUp() const { return client_.GaveUp(Elapsed()); }
  bool accepted() const { return client_.accepted(); }
  bool unknown() const { return client_.unknown(); }  ///< whether it took effect
  const std::string& reason() const { return client_.reason(); }
  int kind() const { return client_.command(); }

 private:
  double Elapsed() const;

  Bus* bus_;
  int64_t given_, id_;  // given: us
  std::vector<double> arguments_;
  world::CommandClient client_;
};

/// Which command it is; its time counts from `origin`, us.
world::CommandKey KeyOf(const command_t& m, int64_t origin);
/// Does it say that it is meant?
bool IsForced(const command_t& m);
/// What answers it at `utime`.
command_ack_t Acknowledgement(const command_t& m, const world::CommandAnswer& answer,
                              int64_t utime);

}  // namespace chase::bus
