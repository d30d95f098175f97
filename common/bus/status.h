#pragma once

#include <cstdint>
#include <string>

#include "chase/status_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"

namespace chase::bus {

/// "0.1.0 (commit 1a2b3c4d5e), configuration 930766865": the last is `cksum` of what --dump-config
/// prints.
std::string ConfiguredVersion(const std::string& configuration);

/// The same of a live process, with where it runs and as what: "0.1.0 (commit 1a2b3c4d5e), host
/// onboard, configuration 930766865".
std::string LiveVersion(const std::string& configuration);

/// The parts of such a version; host and configuration are empty where it does not tell them.
struct Software {
  std::string version, host, configuration;
};
Software SoftwareOf(const std::string& version);

/// Builds the status messages of one process.
class StatusReporter {
 public:
  /// `version`: what STATUS says of it; empty: config::Version().
  explicit StatusReporter(std::string name, std::string version = "");

  /// Status at `utime`, microseconds. Without `measured` it leaves out what differs from run to
  /// run: processor time, memory and stages.
  status_t Make(const Bus& bus, const Node& node, int64_t utime, bool measured);

 private:
  std::string name_, version_;
  int64_t start_ = -1;
  int64_t last_ = -1;
  std::map<std::string, int64_t> last_received_;
};

}  // namespace chase::bus
