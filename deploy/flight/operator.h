#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "chase/command_ack_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "common/world/scenario.h"
#include "services/mission/command_client.h"

namespace chase::flight {

/// Gives a scenario's commands at their times, each until it is answered, as chase-command does.
class Operator : public bus::Node {
 public:
  /// `mission_start` is mission time zero, microseconds.
  Operator(bus::Bus& bus, const std::vector<world::CommandSpec>& commands, int64_t mission_start);

  int64_t TickPeriod() const override { return 50'000; }
  void Tick(int64_t utime) override;

 private:
  void OnAnswer(const command_ack_t& message);

  bus::Bus& bus_;
  std::vector<world::CommandSpec> commands_;
  int64_t mission_start_;
  int64_t id_ = 0;     // of the command that is being given; those before it are over
  int64_t given_ = 0;  // when, us
  std::optional<mission::CommandClient> client_;
};

}  // namespace chase::flight
