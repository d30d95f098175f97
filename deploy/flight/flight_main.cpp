#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "common/bus/channels.h"
#include "common/config/version.h"
#include "deploy/flight/collision_watch.h"
#include "deploy/flight/flight.h"
#include "deploy/flight/progress.h"
#include "deploy/flight/scenario_file.h"
#include "logs/src/metrics.h"
#include "logs/src/output.h"
#include "logs/src/read_flight.h"

namespace chase::flight {
namespace {

struct Arguments {
  FlightOptions options;
  std::string log, metrics, print_config;
  bool end_on_collision = false, quiet = false, light = false;
};

constexpr double kStep = 0.1;            // s of the flight at a time
constexpr double kAfterCollision = 0.2;  // s that are still flown

/// Decodes what the progress line and the end of the flight, where they are asked for, need out of
/// the stream of messages.
void Observe(const std::string& channel, const bus::Bus::Bytes& bytes, Progress* progress,
             CollisionWatch* watch) {
  const int size = static_cast<int>(bytes.size());
  scenario_t scenario;
  truth_t truth;
  const auto tell = [&](const char* of, auto message) {
    if (watch != nullptr && channel == of && message.decode(bytes.data(), 0, size) > 0)
      watch->Add(message);
  };
  tell("FLIGHT_STATE", flight_state_t());
  tell("TRACKING", tracking_t());
  tell("FCU_STATUS", status_t());
  if (progress != nullptr && channel == "SCENARIO" && scenario.decode(bytes.data(), 0, size) > 0)
    progress->SetScenario(scenario);
  if (progress == nullptr && watch == nullptr) return;
  if (channel != "TRUTH" || truth.decode(bytes.data(), 0, size) <= 0) return;
  if (progress != nullptr) progress->Add(truth);
  if (watch != nullptr) watch->Add(truth);
}

void PrintProgress(const world::Scenario& scenario, const Progress& progress, double t,
                   double factor) {
  fmt::print(
      stderr,
      "\r{}: {:6.1f} of {:.0f} s  distance {:5.2f} m  visible {:5.1f} %  {:5.2f} x real time",
      scenario.name, t, scenario.duration_s, progress.distance(), 100.0 * progress.visible_ratio(),
      factor);
}

/// Adds what was measured while flying to what the log holds.
logs::FlightRecord Record(const std::string& log, const bus::Lockstep& lockstep,
                          double real_time_factor) {
  logs::FlightRecord record = logs::ReadFlight(log);
  record.stages.clear();
  for (const auto& [process, usage] : lockstep.Usages()) {
    record.cpu_s[process] = usage.cpu_s;
    for (const auto& [stage, s] : usage.stages)
      record.stages.push_back({process, stage, s.count, s.mean_ms, s.p50_ms, s.p99_ms, s.max_ms});
  }
  record.real_time_factor = real_time_factor;
  return record;
}

int PrintCriteria(const logs::Metrics& metrics, bool part) {
  if (part) fmt::print("of the part flown, {:.1f} s:\n", metrics.flown_s);
  for (const auto& [name, passed] : metrics.criteria)
    if (!part || name != "complete") fmt::print("{:<20} {}\n", name, passed ? "passed" : "FAILED");
  for (const std::string& loss : metrics.losses) fmt::print("{}\n", loss);
  if (metrics.collision_s >= 0.0)
    fmt::print("collision at {:.2f} s with {}\n", metrics.collision_s, metrics.collided_with);
  return metrics.Passed() || part ? 0 : 2;  // criteria are for whole missions
}

/// Without --log a file of light messages is kept only as long as the metrics need it.
class Recording {
 public:
  Recording(const std::string& log, bool light)
      : temporary_(log.empty()),
        light_(temporary_ || light),
        file_(log.empty() ? (std::filesystem::temp_directory_path() /
                             fmt::format("chase-flight-{}.lcm", getpid()))
                                .string()
                          : log),
        writer_(std::in_place, file_) {}
  ~Recording() {
    std::error_code ignored;
    if (temporary_) std::filesystem::remove(file_, ignored);
  }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  void Write(int64_t utime, const std::string& channel, const bus::Bus::Bytes& bytes) {
    if (!light_ || !bus::IsHeavy(channel)) writer_->Write(utime, channel, bytes);
  }
  const std::string& Close() {
    writer_->Close();
    return file_;
  }

 private:
  bool temporary_, light_;
  std::string file_;
  std::optional<bus::LogWriter> writer_;
};

/// Flies until the end that was asked for, or shortly after a collision where that ends it; returns
/// logical over wall time.
double FlyAll(const world::Scenario& scenario, const Arguments& arguments, const Progress& progress,
              const CollisionWatch& watch, Flight* flight) {
  using Clock = std::chrono::steady_clock;
  double end = arguments.options.until > 0.0 ? arguments.options.until : scenario.duration_s + 0.1;
  const auto start = Clock::now();
  double factor = 0.0;
  long steps = 0;
  for (double t = -scenario.settle_s; t < end;) {
    t = std::min(t + kStep, end);
    flight->RunUntil(t);
    if (arguments.end_on_collision && watch.time())
      end = std::min(end, *watch.time() + kAfterCollision);
    factor = (t + scenario.settle_s) / std::chrono::duration<double>(Clock::now() - start).count();
    if (!arguments.quiet && (++steps % 10 == 0 || t >= end))
      PrintProgress(scenario, progress, t, factor);
  }
  if (!arguments.quiet) fmt::print(stderr, "\n");
  return factor;
}

int Fly(const world::Scenario& scenario, const Arguments& arguments) {
  Flight flight(scenario, Configure(scenario, arguments.options));
  Recording recording(arguments.log, arguments.light);
  Progress progress;
  CollisionWatch watch(scenario);
  flight.lockstep().SetTap(
      [&](int64_t utime, const std::string& channel, const bus::Bus::Bytes& bytes) {
        recording.Write(utime, channel, bytes);
        Observe(channel, bytes, arguments.quiet ? nullptr : &progress,
                arguments.end_on_collision ? &watch : nullptr);
      });
  const double factor = FlyAll(scenario, arguments, progress, watch, &flight);
  const auto record = Record(recording.Close(), flight.lockstep(), factor);
  const logs::Metrics metrics = logs::Compute(record);
  if (!arguments.metrics.empty()) logs::WriteMetricsJson(arguments.metrics, record, metrics);
  return PrintCriteria(metrics, arguments.options.until > 0.0);
}

int Run(const Arguments& arguments) {
  const world::Scenario scenario = world::LoadScenario(arguments.options.scenario_file);
  if (arguments.print_config.empty()) {
    for (const std::string& file : {arguments.log, arguments.metrics})
      if (!file.empty()) logs::RequireWritable(file);
    return Fly(scenario, arguments);
  }
  fmt::print("{}", DumpService(Configure(scenario, arguments.options), arguments.print_config));
  return 0;
}

/// Any number compares false with NaN, so that CLI::Range takes it.
std::string MissionTimeProblem(const std::string& text) {
  constexpr double kLongest = 86400.0;  // s
  double t = 0.0;
  if (CLI::detail::lexical_cast(text, t) && t > 0.0 && t <= kLongest) return "";
  return fmt::format("{} is no mission time, above 0 and at most {:.0f} s", text, kLongest);
}

void AddOptions(CLI::App* app, Arguments* a) {
  app->add_option("scenario", a->options.scenario_file, "name in deploy/scenarios, or a file")
      ->required();
  app->add_option("--seed", a->options.seed, "of all noise (default 1)")
      ->check(CLI::Range(int64_t{0}, int64_t{2147483647}));
  app->add_option("--sensors", a->options.sensors, "raw or truth (default: the scenario's)")
      ->check(CLI::IsMember({"raw", "truth"}));
  app->add_option("--planner", a->options.planner, "planning algorithm (default: chase)");
  auto* log = app->add_option("--log", a->log, "record every message into this LCM log");
  app->add_flag("--light", a->light, "leave sweeps and images out of the log")->needs(log);
  auto* metrics = app->add_option("--metrics", a->metrics,
                                  "write the figures of the flight into this JSON file");
  app->add_option(
      "--fault", a->options.faults,
      "NAME or NAME@SECONDS of mission time (negative: before the target moves), besides the "
      "scenario's; repeatable");
  app->add_flag("--end-on-collision", a->end_on_collision,
                "end the flight 0.2 s after the first contact");
  app->add_option("--until", a->options.until, "stop at this mission time, s")
      ->check(MissionTimeProblem);
  app->add_option("--print-config", a->print_config,
                  "print the configuration of this process in this scenario and exit")
      ->excludes(log, metrics);
  app->add_flag("--quiet", a->quiet, "no progress line");
}

/// Sweeps and images come and go by the megabyte: the kernel need not take back and clear them, and
/// finds their addresses at once where it grants huge pages (madvise(2)).
void KeepMemory() {
  constexpr uintptr_t kPage = 2 << 20;  // bytes
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
  mallopt(M_TOP_PAD, 256 << 20);  // a flight's heap, most of the time
  auto* grown = static_cast<char*>(std::malloc(kPage));
  char* begin = grown + (kPage - reinterpret_cast<uintptr_t>(grown) % kPage) % kPage;
  auto* end = static_cast<char*>(sbrk(0));
  if (begin < end) madvise(begin, static_cast<size_t>(end - begin), MADV_HUGEPAGE);
  std::free(grown);
}

}  // namespace
}  // namespace chase::flight

/// Flies a scenario with all nodes in lockstep. Exit codes: 0 flown and the criteria hold, 1 bad
/// use, 2 flown and a criterion failed.
int main(int argc, char** argv) {
  chase::flight::KeepMemory();
  CLI::App app("Flies a scenario with every node in one thread and in logical time.",
               "chase-flight");
  chase::config::AddVersion(&app);
  chase::flight::Arguments arguments;
  chase::flight::AddOptions(&app, &arguments);
  try {
    app.parse(argc, argv);
    auto& scenario = arguments.options.scenario_file;
    scenario = chase::flight::ScenarioFile(scenario);
    return chase::flight::Run(arguments);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-flight: {}; see chase-flight --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-flight: {}\n", e.what());
  }
  return 1;
}
