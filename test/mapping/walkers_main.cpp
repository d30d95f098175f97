// mapping_walkers: flies mapping through random worlds with people in them (chase-world crowd,
// mixed) with the simulator's LiDAR and prints figures against the truth. Not part of ctest: it
// takes minutes.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "deploy/campaign/statistics.h"
#include "deploy/worlds/worlds.h"
#include "walkers.h"

namespace chase::mapping_stage {
namespace {

struct Arguments {
  std::vector<std::string> kinds = {"crowd", "mixed"};
  uint64_t first = 101, count = 30;
  std::string config;
  bool trace = false;
};

double Now() {  // processor time, ms
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double Quantile(std::vector<double> x, double q) {
  std::sort(x.begin(), x.end());
  return x.empty() ? 0.0 : x[static_cast<size_t>(q * static_cast<double>(x.size() - 1))];
}

void Print(const std::string& what, const Share& s) {
  const auto interval = campaign::Wilson(s.held, s.all);
  fmt::print("{:<64}{:7.2f} %  [{:.2f}, {:.2f}]  {} of {}\n", what,
             s.all ? 100.0 * static_cast<double>(s.held) / static_cast<double>(s.all) : 0.0,
             100.0 * interval.low, 100.0 * interval.high, s.held, s.all);
}

void Print(const std::string& what, const std::vector<double>& x, const std::string& unit) {
  fmt::print("{:<64} median {:.2f}, p95 {:.2f}, p99 {:.2f}, most {:.2f} {} of {}\n", what,
             Quantile(x, 0.5), Quantile(x, 0.95), Quantile(x, 0.99), Quantile(x, 1.0), unit,
             x.size());
}

void Print(const std::string& name, const WalkerFigures& f) {
  fmt::print("\n{}: walkers within 6 m, 95 % Wilson intervals\n", name);
  Print("listed, sweeps in view from 1 s on (bar 97 %)", f.listed);
  Print("listed, all sweeps in view", f.any_time);
  Print("in an obstacle of any kind, all sweeps in view", f.held);
  Print("in none, for", f.bare, "s");
  Print("first listed after", f.acquired, "s");
  Print("velocity error <= 0.3 m/s, 0.3 s after a change of it", f.fast);
  Print("velocity error", f.velocity, "m/s");
  Print("longest semi-axis <= true + 0.3 m", f.slim);
  Print("longest semi-axis beyond the true one", f.axis, "m");
  Print("one id in a sighting (bar 95 %)", f.one_id);
  Print("reversal: error <= 0.3 m/s within 0.3 s", f.reversed);
  Print("reversal: nearer to the new velocity within 0.3 s", f.halved);
  Print("other change: error <= 0.3 m/s within 0.3 s", f.stopped);
  Print("beside the target (2 m): no gap above 0.2 s", f.beside);
  Print("out of view for less than 2 s: no gap above 0.2 s", f.hidden);
  Print("in the blind range for less than 2 s: no gap above 0.2 s", f.blind);
  Print("velocity within its published 95 %", f.velocity_honest);
  Print("centre within its published 95 %", f.center_honest);
  fmt::print(
      "sweeps with a mover > 1 m from any: {}, with the target's centre in a mover: {}, of {}\n",
      f.phantoms, f.target_blocked, f.sweeps);
  Print("a sweep", f.ms, "ms");
  std::fflush(stdout);
}

WalkerFigures Fly(const world::Scenario& scenario, uint64_t seed,
                  const mapping::MappingConfig& config, bool trace) {
  const Course course = Behind(scenario);
  Stage stage(course, {}, seed);
  WalkerJudge judge(trace);
  mapping::Mapper mapper(config);
  while (const auto shot = stage.Next()) {
    if (shot->target) mapper.ObserveTarget(*shot->target);
    const double start = Now();
    const auto list = mapper.Insert(shot->sweep);
    judge.figures.ms.push_back(Now() - start);
    mapper.UpdateTree();
    judge.Add(*shot, list);
  }
  judge.Close();
  return judge.figures;
}

void Run(const Arguments& arguments) {
  mapping::MappingConfig config;
  if (!arguments.config.empty()) config::Load(arguments.config, &config);
  WalkerFigures all;
  for (const auto& kind : arguments.kinds) {
    WalkerFigures pooled;
    for (uint64_t seed = arguments.first; seed < arguments.first + arguments.count; ++seed) {
      if (arguments.trace) fmt::print("world {}/{}\n", kind, seed);
      pooled.Add(Fly(worlds::MakeWorld(kind, seed, {}), seed, config, arguments.trace));
    }
    Print(fmt::format("{} {} to {}", kind, arguments.first, arguments.first + arguments.count - 1),
          pooled);
    all.Add(pooled);
  }
  if (arguments.kinds.size() > 1) Print("all", all);
}

}  // namespace
}  // namespace chase::mapping_stage

int main(int argc, char** argv) {
  chase::mapping_stage::Arguments arguments;
  CLI::App app("Mapping's movers against the truth in random worlds with people.");
  chase::config::AddVersion(&app);
  app.add_option("--kinds", arguments.kinds, "kinds of chase-world (default crowd and mixed)");
  app.add_option("--first", arguments.first, "first seed");
  app.add_option("--seeds", arguments.count, "worlds of each kind");
  app.add_option("--config", arguments.config, "file with mapping's config");
  app.add_flag("--trace", arguments.trace, "print every walker that is judged");
  try {
    app.parse(argc, argv);
    chase::mapping_stage::Run(arguments);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "mapping_walkers: {}; see mapping_walkers --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "mapping_walkers: {}\n", e.what());
  }
  return 1;
}
