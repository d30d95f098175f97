#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "common/config/config.h"

namespace CLI {
class App;
}

namespace chase::bus {

/// The part of a service that differs from process to process.
struct ServiceSpec {
  std::string name;         ///< "planning": binary chase-planning, status PLANNING_STATUS
  std::string description;  ///< one sentence for --help
  std::function<std::string()> dump_config;
  std::function<void(const std::string& file)> load_config;  ///< throws std::runtime_error
  std::function<std::unique_ptr<Node>(Bus&)> make_node;
  std::function<void(CLI::App&)> add_flags;  ///< its own ones; may be empty
  std::string live_only;  ///< why it does not --replay, and what to use; empty: it does
  /// Runs in the process's own manner, until StopRequested(), and returns true; false, or empty: it
  /// runs live or replays.
  std::function<bool()> run;
};

/// Has SIGINT or SIGTERM come?
bool StopRequested();

/// Flags, config, signals, 1 Hz status, watchdog, replay and exit codes of a process. Exit codes: 0
/// ended as asked, 1 bad use (one line on stderr says what, where and how to mend it).
int RunService(const ServiceSpec& spec, int argc, char** argv);

/// `return RunService<PlanningNode, PlanningConfig>("planning", "Plans the chase.", argc, argv);`
/// with the reason where it is live_only.
template <class NodeType, class Config>
int RunService(const std::string& name, const std::string& description, int argc, char** argv,
               const std::string& live_only = "") {
  auto config = std::make_shared<Config>();
  ServiceSpec spec;
  spec.name = name;
  spec.description = description;
  spec.live_only = live_only;
  spec.dump_config = [config] { return config::Dump(*config); };
  spec.load_config = [config](const std::string& file) { config::Load(file, config.get()); };
  spec.make_node = [config](Bus& bus) { return std::make_unique<NodeType>(bus, *config); };
  return RunService(spec, argc, argv);
}

}  // namespace chase::bus
