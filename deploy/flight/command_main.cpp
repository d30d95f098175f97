#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "chase/flight_state_t.hpp"
#include "common/bus/command_call.h"
#include "common/bus/convert.h"
#include "common/bus/udp_bus.h"
#include "common/config/version.h"
#include "services/mission/progress.h"

namespace chase::mission {
namespace {

constexpr int64_t kWait = 20'000;  // us at a time for messages
enum Exit {
  kAccepted = 0,
  kBadUse = 1,
  kRefused = 2,
  kNoAnswer = 3,
  kNotReached = 4,
  kUnknown = 5
};

struct Arguments {
  std::string command, vehicle, url, key_file;
  std::vector<double> place;  // px
  bool wait = false, force = false;
  double timeout = 120.0;
};

/// The command on its way, and the flight's state meanwhile.
class Session {
 public:
  Session(bus::UdpBus* bus, int kind, const std::vector<double>& arguments)
      : bus_(*bus), start_(bus->Now()), call_(*bus, kind, bus->identity().start, arguments) {
    bus_.Subscribe<command_ack_t>("COMMAND_ACK", [this](const command_ack_t& m) { call_.Hear(m); });
    bus_.Subscribe<flight_state_t>("FLIGHT_STATE", [this](const flight_state_t& m) {
      state_ = std::string(Name(static_cast<State>(m.state))) + ": " + m.reason;
      if (call_.answered())
        progress_ = ProgressOf(static_cast<Event>(call_.kind()), static_cast<State>(m.state));
    });
  }

  void Turn() {
    call_.Turn();
    bus_.Handle(kWait);
  }

  double elapsed() const { return bus::Seconds(bus_.Now(), start_); }
  const bus::CommandCall& call() const { return call_; }
  Progress progress() const { return progress_; }
  const std::string& state() const { return state_; }

 private:
  bus::UdpBus& bus_;
  int64_t start_;
  bus::CommandCall call_;
  Progress progress_ = Progress::kUnderWay;
  std::string state_;
};

int Fail(int code, const std::string& what) {
  fmt::print(stderr, "chase-command: {}\n", what);
  return code;
}

int AwaitAnswer(const Arguments& a, Session* session) {
  const bus::CommandCall& call = session->call();
  while (!call.answered() && !call.GaveUp()) session->Turn();
  if (!call.answered())
    return Fail(kNoAnswer,
                fmt::format("{}: no answer{}; does chase-{} run{}?", a.command,
                            session->state().empty() ? "" : ", though FLIGHT_STATE is heard",
                            a.command == "select" ? "perception" : "mission",
                            a.vehicle.empty() ? "" : " on vehicle '" + a.vehicle + "'"));
  while (a.force && !call.IsDone()) session->Turn();
  if (call.unknown()) return Fail(kUnknown, a.command + ": " + call.reason());
  if (!call.accepted()) return Fail(kRefused, "refused: " + call.reason());
  fmt::print("{}\n", call.reason());
  std::fflush(stdout);
  return kAccepted;
}

int AwaitEnd(const Arguments& a, Session* session) {
  while (session->progress() == Progress::kUnderWay && session->elapsed() < a.timeout)
    session->Turn();
  if (session->progress() == Progress::kUnderWay)
    return Fail(kNotReached, fmt::format("{}: not there after {} s, {}", a.command, a.timeout,
                                         session->state()));
  if (session->progress() == Progress::kMissed)
    return Fail(kNotReached, fmt::format("{}: it came otherwise, {}", a.command, session->state()));
  fmt::print("{}\n", session->state());
  return kAccepted;
}

int Run(const Arguments& a) {
  if (a.force && a.command != "kill")
    return Fail(kBadUse, "--force belongs to kill; see chase-command --help");
  if (a.command == "select" ? a.place.size() != 2 : !a.place.empty())
    return Fail(kBadUse,
                "select X Y takes a column and a row of the image, px, and no other command "
                "does; see chase-command --help");
  if (a.wait && a.command == "select")
    return Fail(kBadUse,
                "--wait belongs to commands that move the vehicle; see chase-command --help");
  bus::UdpBus bus(a.url, a.vehicle, bus::LoadSeal(a.key_file));
  bus.SetIdentity({"command", a.vehicle, bus.Now()});
  Session session(&bus, *world::CommandNamed(a.command),
                  a.force ? std::vector<double>{1.0} : a.place);
  const int code = AwaitAnswer(a, &session);
  return code == kAccepted && a.wait ? AwaitEnd(a, &session) : code;
}

/// Any number compares false with NaN, so that CLI::Range takes it.
std::string TimeoutProblem(const std::string& text) {
  double t = 0.0;
  if (CLI::detail::lexical_cast(text, t) && t > 0.0 && t <= 86400.0) return "";
  return text + " is no time, above 0 and at most 86400 s";
}

void AddOptions(CLI::App* app, Arguments* a) {
  a->url = bus::DefaultUrl();
  app->add_option("command", a->command,
                  "takeoff, chase, hold, search, return, land, stop, kill or select")
      ->required()
      ->check(CLI::IsMember(
          std::vector<std::string>(world::kCommandNames.begin(), world::kCommandNames.end())));
  app->add_option("place", a->place,
                  "of select: X Y, column and row of the target in the image, px")
      ->expected(0, 2);
  app->add_option("--vehicle", a->vehicle, "channel prefix of the vehicle that is meant");
  app->add_option("--key-file", a->key_file,
                  "64 hexadecimal digits that the vehicle's messages are sealed with");
  auto* wait = app->add_flag("--wait", a->wait,
                             "until the flight is there: in the air, chasing, holding, landed");
  app->add_flag("--force", a->force, "of kill, which cuts the motors wherever it is, and it falls");
  app->add_option("--timeout", a->timeout, "of --wait, s (default 120)")
      ->check(TimeoutProblem)
      ->needs(wait);
  app->add_option(
      "--lcm-url", a->url,
      "LCM provider (default: $LCM_DEFAULT_URL, else that of the installed units, else built in)");
  app->footer(
      "Exit codes: 0 accepted (with --wait: and reached), 1 bad use, 2 refused, 3 no answer "
      "within 5 s, 4 not reached, 5 not known whether it took effect: it was given before the "
      "mission process started.\n"
      "takeoff: what hangs steeply above is seen by no sensor; whoever gives it vouches that the "
      "column above the vehicle is free.");
}

}  // namespace
}  // namespace chase::mission

/// Gives the vehicle one command, again and again until it is answered; it takes effect once.
int main(int argc, char** argv) {
  CLI::App app("Gives the vehicle a command.", "chase-command");
  chase::config::AddVersion(&app);
  chase::mission::Arguments arguments;
  chase::mission::AddOptions(&app, &arguments);
  try {
    app.parse(argc, argv);
    return chase::mission::Run(arguments);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-command: {}; see chase-command --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-command: {}\n", e.what());
  }
  return 1;
}
