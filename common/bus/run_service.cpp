#include "common/bus/run_service.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/channels.h"
#include "common/bus/live_loop.h"
#include "common/bus/log_bus.h"
#include "common/bus/status.h"
#include "common/bus/udp_bus.h"
#include "common/config/version.h"

namespace chase::bus {

namespace {

constexpr int64_t kStatusPeriod = 1000000;  // us
constexpr int64_t kLookPeriod = 50000;      // us: what changes is told at once

volatile std::sig_atomic_t stop_requested = 0;

void RequestStop(int) { stop_requested = 1; }

struct Flags {
  std::string config, url, key_file, replay, out;
  std::optional<std::string> prefix;  // none: live none, of a log its own
  bool dump_config = false;
};

/// They are not in --help. CLI11's own errors do not name hidden options.
void Refuse(CLI::App* app, const std::vector<std::string>& options, const std::string& why) {
  for (const std::string& name : options)
    app->get_option(name)->group("")->check([name, why](const std::string&) -> std::string {
      throw std::runtime_error(name + ": " + why);
    });
}

void AddFlags(CLI::App* app, const std::string& live_only, Flags* flags) {
  flags->url = DefaultUrl();
  app->add_option("--config", flags->config, "YAML file that overrides the defaults");
  app->add_flag("--dump-config", flags->dump_config, "print the complete configuration and exit");
  auto* url = app->add_option(
      "--lcm-url", flags->url,
      "LCM provider (default: $LCM_DEFAULT_URL, else that of the installed units, else built in)");
  app->add_option("--channel-prefix", flags->prefix,
                  std::string("the vehicle: in front of every channel's name (default: none") +
                      (live_only.empty() ? "; of --replay: what the log has)" : ")"));
  auto* key = app->add_option(
      "--key-file", flags->key_file,
      "64 hexadecimal digits that seal the vehicle's messages (default: not sealed)");
  auto* replay = app->add_option("--replay", flags->replay,
                                 "drive the service by this LCM log, in logical time");
  app->add_option("--out", flags->out, "LCM log that --replay writes");
  if (live_only.empty())
    replay->excludes(url, key);  // what would do nothing is refused
  else
    Refuse(app, {"--replay", "--out"}, live_only);
  config::AddVersion(app);
}

/// Live processing until a signal comes or the node is done.
void RunLive(const ServiceSpec& spec, const Flags& flags) {
  const std::string vehicle = flags.prefix.value_or("");
  UdpBus bus(flags.url, vehicle, LoadSeal(flags.key_file));
  bus.SetIdentity({spec.name, vehicle, bus.Now()});
  const auto node = spec.make_node(bus);
  StatusReporter reporter(spec.name, LiveVersion(spec.dump_config()));
  const std::string channel = StatusChannel(spec.name);
  NodeReport told;
  const auto report = [&](int64_t now) {
    told = node->Report();
    bus.Publish(channel, reporter.Make(bus, *node, now, true));
  };
  sd_notify(0, "READY=1");
  int64_t now = bus.Now();
  const bool ticked = node->TickPeriod() > 0;
  TickClock ticks(node->TickPeriod(), now);
  int64_t next_status = now, next_look = now;
  while (stop_requested == 0 && !node->Done()) {
    now = bus.Now();
    if (ticks.Due(now)) {
      bus.CountTick();
      node->Tick(ticks.Take(now));
    }
    if (now >= next_status) {
      report(now);
      sd_notify(0, "WATCHDOG=1");
      next_status = std::max(next_status + kStatusPeriod, now);
    } else if (now >= next_look) {
      next_look = now + kLookPeriod;
      const NodeReport is = node->Report();
      if (is.state != told.state || is.phase != told.phase) report(now);
    }
    int64_t due = std::min(next_status, next_look);
    if (ticked) due = std::min(due, ticks.next());
    bus.Handle(due - bus.Now());
  }
  report(bus.Now());
  sd_notify(0, "STOPPING=1");
}

/// How the configuration or the commit that is replayed with differs from what the log was flown
/// with; empty where it does not, or the log does not tell.
std::string Departure(const ServiceSpec& spec, const std::string& log, const std::string& vehicle) {
  const Software flown = SoftwareOf(VersionIn(log, spec.name, vehicle));
  const Software here = SoftwareOf(ConfiguredVersion(spec.dump_config()));
  const bool configured = !flown.configuration.empty() && flown.configuration != here.configuration;
  if (!configured && (flown.version.empty() || flown.version == here.version)) return "";
  const auto words = [](const Software& s) {
    return (s.configuration.empty() ? "" : "configuration " + s.configuration + ", ") + s.version;
  };
  const auto file = std::filesystem::path(log).parent_path() / (spec.name + ".yaml");
  const std::string cure =
      std::filesystem::exists(file)
          ? file.string()
          : "FILE with what chase-flight SCENARIO --print-config " + spec.name + " prints";
  return fmt::format("flown with {}; this is {}{}", words(flown), words(here),
                     configured ? "; use --config " + cure : "");
}

void RunReplay(const ServiceSpec& spec, const Flags& flags) {
  if (flags.out.empty())
    throw std::runtime_error("--replay needs --out FILE, where the outputs go");
  std::error_code none;  // neither need exist
  if (std::filesystem::equivalent(flags.out, flags.replay, none))
    throw std::runtime_error("--out " + flags.out + " is the log that is replayed; name another");
  LogBus bus(flags.replay, flags.out);
  const std::string vehicle = flags.prefix ? *flags.prefix : VehicleIn(flags.replay);
  bus.SetIdentity(IdentityIn(flags.replay, spec.name, vehicle));
  if (const std::string line = Departure(spec, flags.replay, vehicle); !line.empty())
    fmt::print(stderr, "chase-{}: {}\n", spec.name, line);
  const auto node = spec.make_node(bus);
  StatusReporter reporter(spec.name, ConfiguredVersion(spec.dump_config()));
  int64_t next_status = -1;
  bus.Run(node.get(), [&](int64_t now) {
    if (now < next_status) return;
    bus.Publish(StatusChannel(spec.name), reporter.Make(bus, *node, now, false));
    next_status = now + kStatusPeriod;
  });
  for (const std::string& line : bus.shortfalls())
    fmt::print(stderr, "chase-{}: {}\n", spec.name, line);
}

int Run(const ServiceSpec& spec, const Flags& flags) {
  if (!flags.config.empty()) spec.load_config(flags.config);
  if (flags.dump_config) {
    std::fputs(spec.dump_config().c_str(), stdout);
    return 0;
  }
  if (!flags.out.empty() && flags.replay.empty())
    throw std::runtime_error("--out " + flags.out + " does nothing without --replay; name a log");
  std::signal(SIGINT, RequestStop);
  std::signal(SIGTERM, RequestStop);
  if (spec.run && spec.run()) return 0;
  if (!flags.replay.empty())
    RunReplay(spec, flags);
  else
    RunLive(spec, flags);
  return 0;
}

}  // namespace

bool StopRequested() { return stop_requested != 0; }

int RunService(const ServiceSpec& spec, int argc, char** argv) {
  const std::string program = "chase-" + spec.name;
  CLI::App app(spec.description, program);
  Flags flags;
  AddFlags(&app, spec.live_only, &flags);
  if (spec.add_flags) spec.add_flags(app);
  try {
    app.parse(argc, argv);
    return Run(spec, flags);
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "{}: {}; see {} --help\n", program, e.what(), program);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", program, e.what());
  }
  return 1;
}

}  // namespace chase::bus
