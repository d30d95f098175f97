// chase-campaign: flies many flights in lockstep and judges them together.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <boost/interprocess/sync/file_lock.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "common/config/version.h"
#include "common/world/scenario.h"
#include "deploy/campaign/comparison.h"
#include "deploy/campaign/flight_job.h"
#include "deploy/campaign/flight_list.h"
#include "deploy/campaign/judge.h"
#include "deploy/campaign/process.h"
#include "deploy/campaign/table.h"
#include "deploy/campaign/text_file.h"

namespace chase::campaign {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  Request request;
  Setup setup;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::string compare, baseline;
  bool list = false, fly = false, quiet = false;
};

Json Entry(const Flight& flight, const Job& job, const Setup& setup) {
  return Judge(flight, Json::parse(ReadText(job.file)), setup.duration);
}

/// Two campaigns would write into each other's flights. The lock ends with this process.
boost::interprocess::file_lock Claimed(const std::string& folder) {
  const std::string file = (fs::path(folder) / ".lock").string();
  std::ofstream(file, std::ios::app).close();
  boost::interprocess::file_lock lock(file.c_str());
  if (!lock.try_lock())
    throw std::runtime_error(
        folder + " is another campaign's, which still flies: wait, or take another --out");
  return lock;
}

void RunAll(const std::vector<Flight>& flights, const std::vector<Job>& jobs, const Options& o) {
  MakeFolder(o.setup.out);
  const boost::interprocess::file_lock claimed = Claimed(o.setup.out);
  std::map<std::string, const Flight*> by_file;
  for (size_t i = 0; i < jobs.size(); ++i) by_file[jobs[i].file] = &flights[i];
  RunOptions run;
  run.jobs = o.jobs;
  run.quiet = o.quiet;
  run.failed = [&](const Job& job) {
    return Entry(*by_file.at(job.file), job, o.setup)["outcome"] != outcome::kPassed;
  };
  Run(jobs, run);
}

std::vector<Json> Gather(const std::vector<Flight>& flights, const std::vector<Job>& jobs,
                         const Setup& setup) {
  std::vector<Json> entries;
  for (size_t i = 0; i < flights.size(); ++i) {
    entries.push_back(Entry(flights[i], jobs[i], setup));
    entries.back()["command"] = RepeatLine(flights[i], setup);
    if (const std::string report = ReportOf(flights[i], setup); !report.empty())
      entries.back()["report"] = report;
  }
  return entries;
}

/// Scenarios whose map is drawn, but from a seed of their own, look like one random map per flight.
void TellOfMaps(const std::vector<Flight>& flights) {
  std::map<std::string, std::set<int64_t>> seeds;
  for (const Flight& flight : flights)
    if (flight.kind.empty()) seeds[flight.file].insert(flight.seed);
  for (const auto& [file, flown] : seeds)
    if (flown.size() > 1 && world::LoadScenario(file).world.forest.count > 0)
      fmt::print(stderr,
                 "chase-campaign: note: {} has the same map with every seed, which is of noise and "
                 "gusts; --kinds forest is another forest for each\n",
                 file);
}

/// What a later --compare needs, a line per flight.
std::string Baseline(const std::vector<Json>& entries) {
  std::string text;
  for (const Json& entry : entries) {
    Json slim;
    for (const char* key : {"scenario", "kind", "fault", "seed", "outcome", "why", "visible_ratio",
                            "distance_error", "odometry_ate_m"})
      if (entry.contains(key)) slim[key] = entry[key];
    text += (text.empty() ? "[\n" : ",\n") + slim.dump();
  }
  return text + "\n]\n";
}

int Execute(const Options& o) {
  std::vector<Json> before;
  if (!o.compare.empty()) before = LoadFlights(o.compare);
  const std::vector<Flight> flights = Flights(o.request);
  const std::vector<Job> jobs = Jobs(flights, o.setup);
  if (o.list) {
    for (const Job& job : jobs) fmt::print("{}\n", ShellLine(job.command));
    return 0;
  }
  if (o.fly) {
    if (flights.size() != 1) throw std::runtime_error("--fly takes one flight");
    Fly(flights.front(), jobs.front(), o.setup);
    return 0;
  }
  TellOfMaps(flights);
  RunAll(flights, jobs, o);
  const std::vector<Json> entries = Gather(flights, jobs, o.setup);
  const std::string table = Table(entries);
  WriteText((fs::path(o.setup.out) / "flights.json").string(), Json(entries).dump(1) + "\n");
  WriteText((fs::path(o.setup.out) / "table.md").string(), table);
  if (!o.baseline.empty()) WriteText(o.baseline, Baseline(entries));
  fmt::print("{}", table);
  if (o.compare.empty()) return 0;
  const Comparison comparison = Compare(before, entries);
  fmt::print("\nAgainst {}:\n{}", o.compare, comparison.text);
  return comparison.worse ? 3 : 0;
}

/// Any number compares false with NaN, so that CLI::Range takes it.
std::string DurationProblem(const std::string& text) {
  constexpr double kLongest = 86400.0;  // s, chase-flight's
  double t = 0.0;
  if (CLI::detail::lexical_cast(text, t) && t > 0.0 && t <= kLongest) return "";
  return fmt::format("{} is no duration, above 0 and at most {:.0f} s", text, kLongest);
}

void AddOptions(CLI::App* app, Options* o) {
  auto* scenarios = app->add_option("--scenarios", o->request.scenarios,
                                    "names from deploy/scenarios, files, or world:KIND (default: "
                                    "gym, unless there are kinds)");
  auto* kinds =
      app->add_option("--kinds", o->request.kinds,
                      "random worlds of these kinds, another map for every seed; all: every "
                      "kind");
  auto* faults = app->add_option(
      "--faults", o->request.faults,
      "NAME or NAME@SECONDS; all: every one that can strike; none: no fault (default)");
  for (auto* option : {scenarios, kinds, faults}) option->delimiter(',');
  auto* seeds =
      app->add_option("--seeds", o->request.seeds,
                      "of noise and gusts, and of the maps of kinds; such as 1-20 or 1,5,9 "
                      "(default 1)");
  app->add_option("--flights", o->request.flights_file,
                  "instead: a file with a line scenario,seed,fault per flight")
      ->excludes(scenarios, kinds, faults, seeds);
  app->add_option("--duration", o->setup.duration, "of every mission, s (default: the scenario's)")
      ->check(DurationProblem);
  app->add_option("--jobs", o->jobs, "flights at a time (default: one per core)")
      ->check(CLI::Range(1, 1024));
  app->add_option("--out", o->setup.out, "folder of the results")->required();
  app->add_option("--programs", o->setup.programs,
                  "folder of chase-flight, chase-world and chase-report (default: this program's)");
  auto* compare =
      app->add_option("--compare", o->compare,
                      "an earlier campaign's folder or flights.json: what got better and worse");
  auto* baseline = app->add_option("--baseline", o->baseline,
                                   "write what a later --compare needs into this file");
  app->add_flag("--fly-on", o->setup.fly_on, "a collision does not end a flight");
  auto* list = app->add_flag("--list", o->list, "print one command per flight and fly nothing");
  app->add_flag("--fly", o->fly, "fly the one flight that is named and gather nothing")
      ->excludes(compare, baseline, list);
  app->add_flag("--quiet", o->quiet, "no progress bar");
}

}  // namespace
}  // namespace chase::campaign

/// Exit codes: 0 flown, whatever became of the flights; 1 bad use; 3 with --compare: worse.
int main(int argc, char** argv) {
  CLI::App app("Flies many flights in lockstep and judges them together.", "chase-campaign");
  chase::config::AddVersion(&app);
  chase::campaign::Options options;
  chase::campaign::AddOptions(&app, &options);
  try {
    options.setup.programs =
        std::filesystem::path(chase::campaign::ThisProgram()).parent_path().string();
    app.parse(argc, argv);
    return chase::campaign::Execute(options);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-campaign: {}; see chase-campaign --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-campaign: {}\n", e.what());
  }
  return 1;
}
