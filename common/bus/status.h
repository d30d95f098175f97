#pragma once

#include <cstdint>
#include <string>

#include "chase/status_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"

namespace chase::bus {

/// Builds the status messages of one process.
class StatusReporter {
 public:
  explicit StatusReporter(std::string name) : name_(std::move(name)) {}

  /// Status at `utime`, microseconds. Without `measured` it leaves out what differs from run to
  /// run: processor time, memory and stages.
  status_t Make(const Bus& bus, const Node& node, int64_t utime, bool measured);

 private:
  std::string name_;
  int64_t start_ = -1;
  int64_t last_ = -1;
  std::map<std::string, int64_t> last_received_;
};

}  // namespace chase::bus
