#include <CLI/CLI.hpp>
#include <csignal>
#include <optional>

#include "common/bus/run_service.h"
#include "deploy/recorder/recorder_node.h"

int main(int argc, char** argv) {
  chase::recorder::RecorderConfig config;
  std::optional<std::string> folder, name;
  std::optional<double> heavy_minutes, keep_free, rotate_mb, rotate_minutes;

  chase::bus::ServiceSpec spec;
  spec.name = "recorder";
  spec.description =
      "Records every message into LCM logs; sweeps, images and maps for a while only.";
  spec.live_only = "a log is recorded already; chase-log cuts, filters and merges logs";
  // CLI11 prints a default only where there is one; these are the configuration's.
  spec.add_flags = [&](CLI::App& app) {
    app.add_option("--folder", folder, "that the logs are written into");
    app.add_option("--name", name, "of the logs, NAME.lcm (default: the time of the start, UTC)");
    app.add_option("--heavy-minutes", heavy_minutes,
                   "sweeps, images and maps are kept for so long, in logs of their own; 0: not at "
                   "all, negative: for ever, in the log of all others");
    app.add_option("--keep-free", keep_free,
                   "MB of disk below which sweeps, images and maps are given up, the oldest first");
    app.add_option("--rotate-mb", rotate_mb,
                   "a log is followed by the next at this size; 0: at none");
    app.add_option("--rotate-minutes", rotate_minutes, "and after this time; 0: never");
  };
  spec.dump_config = [&] { return chase::config::Dump(config); };
  spec.load_config = [&](const std::string& file) { chase::config::Load(file, &config); };
  spec.run = [&] {
    config.folder = folder.value_or(config.folder);
    config.name = name.value_or(config.name);
    config.heavy_minutes = heavy_minutes.value_or(config.heavy_minutes);
    config.keep_free_mb = keep_free.value_or(config.keep_free_mb);
    config.rotate_mb = rotate_mb.value_or(config.rotate_mb);
    config.rotate_minutes = rotate_minutes.value_or(config.rotate_minutes);
    const std::string problem = config.Problem();
    if (!problem.empty()) throw std::runtime_error(problem);
    return false;
  };
  spec.make_node = [&](chase::bus::Bus& bus) {
    return std::make_unique<chase::recorder::RecorderNode>(bus, config);
  };
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grew to the system's limit is followed by the next
  return chase::bus::RunService(spec, argc, argv);
}
