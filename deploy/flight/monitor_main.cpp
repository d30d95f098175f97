#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <string>

#include "chase/event_t.hpp"
#include "common/bus/udp_bus.h"
#include "common/config/version.h"
#include "deploy/flight/progress.h"

namespace {

volatile std::sig_atomic_t stop_requested = 0;
constexpr int64_t kPeriod = 1000000;  // us between lines

void Print(const chase::flight::Progress& progress, int64_t now) {
  fmt::print(
      "{{\"mission_time\": {:.2f}, \"duration\": {:.1f}, \"distance\": {:.2f}, "
      "\"visible\": {:.3f}, \"rtf\": {:.3f}, \"done\": {}}}\n",
      progress.mission_time(), progress.duration(), progress.distance(), progress.visible_ratio(),
      progress.RealTimeFactor(now), progress.done());
  std::fflush(stdout);
}

/// Faults that the launcher brings about: lines +NAME and -NAME where one begins and ends.
class Faults {
 public:
  explicit Faults(chase::bus::Bus* bus) : bus_(*bus) {}

  void PassOn() {
    pollfd in{STDIN_FILENO, POLLIN, 0};
    char bytes[256];
    while (poll(&in, 1, 0) > 0) {
      const ssize_t n = read(STDIN_FILENO, bytes, sizeof bytes);
      if (n <= 0) break;
      lines_.append(bytes, static_cast<size_t>(n));
    }
    for (size_t end; (end = lines_.find('\n')) != std::string::npos; lines_.erase(0, end + 1))
      if (end > 1) Tell(lines_[0] == '+', lines_.substr(1, end - 1));
  }

 private:
  void Tell(bool begins, const std::string& name) {
    chase::event_t m{};
    m.utime = bus_.Now();
    m.name = name;
    m.phase = begins ? chase::event_t::BEGINS : chase::event_t::ENDS;
    bus_.Publish("FAULT", m);
  }

  chase::bus::Bus& bus_;
  std::string lines_;
};

int Watch(const std::string& url, const std::string& prefix, bool with_faults) {
  chase::bus::UdpBus bus(url, prefix);
  bus.SetIdentity({"flight-monitor", prefix, bus.Now()});
  Faults faults(&bus);
  chase::flight::Progress progress;
  bool moving = false;
  bus.Subscribe<chase::scenario_t>("SCENARIO",
                                   [&](const chase::scenario_t& m) { progress.SetScenario(m); });
  bus.Subscribe<chase::truth_t>("TRUTH", [&](const chase::truth_t& m) {
    progress.NoteArrival(bus.Now());
    progress.Add(m);
    moving = true;
  });
  int64_t next = bus.Now() + kPeriod;
  while (stop_requested == 0 && !progress.done()) {
    bus.Handle(next - bus.Now());
    if (with_faults) faults.PassOn();
    if (bus.Now() < next) continue;
    if (moving) Print(progress, bus.Now());
    next += kPeriod;
  }
  Print(progress, bus.Now());
  return progress.done() ? 0 : 1;
}

}  // namespace

/// Prints one JSON line a second about the flight on the bus and ends with the mission.
int main(int argc, char** argv) {
  CLI::App app("Prints one JSON line a second about the flight on the bus; exits 0 at its end.",
               "chase-flight-monitor");
  chase::config::AddVersion(&app);
  std::string url = chase::bus::DefaultUrl(), prefix;
  bool faults = false;
  app.add_option(
      "--lcm-url", url,
      "LCM provider (default: $LCM_DEFAULT_URL, else that of the installed units, else built in)");
  app.add_option("--channel-prefix", prefix, "put in front of every channel's name");
  app.add_flag("--faults", faults,
               "publish FAULT for each line of the standard input: +NAME begins, -NAME ends");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    fmt::print(stderr, "chase-flight-monitor: {}; see chase-flight-monitor --help\n", e.what());
    return 1;
  }
  std::signal(SIGINT, [](int) { stop_requested = 1; });
  std::signal(SIGTERM, [](int) { stop_requested = 1; });
  try {
    return Watch(url, prefix, faults);
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-flight-monitor: {}\n", e.what());
    return 1;
  }
}
