#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/command_call.h"
#include "common/bus/node.h"
#include "common/world/scenario.h"

namespace chase::flight {

/// Gives a scenario's commands at their times, each until it is answered, as chase-command does.
class Operator : public bus::Node {
 public:
  /// `mission_start` is mission time zero, microseconds.
  Operator(bus::Bus& bus, const std::vector<world::CommandSpec>& commands, int64_t mission_start);

  int64_t TickPeriod() const override { return 50'000; }
  void Tick(int64_t utime) override;

 private:
  bus::Bus& bus_;
  std::vector<world::CommandSpec> commands_;
  int64_t mission_start_;
  int64_t id_ = 0;  // of the command that is being given; those before it are over
  std::optional<bus::CommandCall> call_;
};

}  // namespace chase::flight
