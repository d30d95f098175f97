// mapping_campaign: flies mapping through the simulator's worlds with its LiDAR and prints figures
// against the truth. Not part of ctest: it takes minutes.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "score.h"

namespace chase::mapping_stage {
namespace {

struct Arguments {
  uint64_t first = 1, count = 2;
  std::vector<std::string> only;
  std::string config;
  double length = 1000.0;
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

void PrintHead() {
  fmt::print(
      "cover, worst: share of surface points hit 3 times or more that are enclosed, all looks and "
      "the worst one, %\nblock, max: free volume within 5 m that is blocked, %\nell: most "
      "ellipsoids; cut: left out of the list; ids: changes per obstacle and minute\nfalse: updates "
      "with a mover where none is; ghost: with an obstacle where a mover was over 1 s before\n"
      "target: updates with the target's centre in an obstacle; p50, p99: ms a sweep\n\n"
      "{:<22}{:>7}{:>9}{:>9}{:>7}{:>7}{:>5}{:>5}{:>7}{:>7}{:>7}{:>8}{:>7}{:>7}\n",
      "flight", "sweeps", "cover", "worst", "block", "max", "ell", "cut", "ids", "false", "ghost",
      "target", "p50", "p99");
}

void Print(const std::string& name, const Score& s) {
  const double surface = static_cast<double>(std::max(1L, s.surface));
  fmt::print(
      "{:<22}{:7d}{:9.3f}{:9.3f}{:7.2f}{:7.2f}{:5d}{:5d}{:7.3f}{:7d}{:7d}{:8d}{:7.1f}{:7.1f}\n",
      name, s.sweeps, 100.0 * static_cast<double>(s.surface_held) / surface,
      100.0 * s.worst_coverage, 100.0 * s.blocked_sum / std::max(1, s.checks),
      100.0 * s.worst_blocked, s.most, s.cut, s.id_changes / std::max(1e-9, s.obstacle_minutes),
      s.false_movers, s.ghosts, s.target_blocked, Quantile(s.ms, 0.5), Quantile(s.ms, 0.99));
  for (size_t i = 0; i < s.movers.size(); ++i) {
    const auto& m = s.movers[i];
    if (m.sights == 0) continue;
    fmt::print(
        "    mover {}: in sight {} times, missed {}, listed after {:.1f} s at most; velocity error "
        "{:.2f} mean {:.2f} m/s max in {} updates, {:.2f} max half hidden in {}; {} ids\n",
        i + 1, m.sights, m.missed, m.worst_delay, m.velocity_sum / std::max(1, m.updates),
        m.worst_velocity, m.updates, m.worst_hidden, m.hidden_updates, m.ids.size());
    const double n = std::max(1, m.judged);
    fmt::print(
        "        squared error over variance: velocity {:.2f}, {:.0f} % beyond 95 %; centre "
        "{:.2f}, "
        "{:.0f} %\n",
        m.velocity_nees / n, 100.0 * m.velocity_beyond / n, m.center_nees / n,
        100.0 * m.center_beyond / n);
  }
  if (s.mover_points > 0)
    fmt::print("    returns of movers inside an obstacle, from 0.5 s in sight: {:.1f} %\n",
               100.0 * s.mover_points_held / s.mover_points);
  std::fflush(stdout);
}

void Fly(const std::string& name, const Course& course, const Errors& errors, uint64_t seed,
         const mapping::MappingConfig& config, bool trace) {
  Stage stage(course, errors, seed);
  Score score(course, stage, trace);
  mapping::Mapper mapper(config);
  while (const auto shot = stage.Next()) {
    if (shot->target) mapper.ObserveTarget(*shot->target);
    const double start = Now();
    const auto list = mapper.Insert(shot->sweep);
    score.ms.push_back(Now() - start);
    mapper.UpdateTree();
    score.Add(*shot, list);
  }
  score.Close();
  Print(fmt::format("{}/{}", name, seed), score);
}

void Remember(double length, const mapping::MappingConfig& config) {
  const Course course = Long(length);
  Stage stage(course, {}, 1);
  mapping::Mapper mapper(config);
  fmt::print("\nmemory of the map over {:.0f} m at 5 m/s, MiB:", length);
  double most = 0.0;
  int sweeps = 0;
  while (const auto shot = stage.Next()) {
    mapper.Insert(shot->sweep);
    mapper.UpdateTree();
    const double size = static_cast<double>(mapper.Bytes()) / (1 << 20);
    most = std::max(most, size);
    if (++sweeps % 200 == 0) fmt::print(" {:.0f} m {:.1f}", shot->place.x(), size);
    std::fflush(stdout);
  }
  fmt::print("; most {:.1f}\n", most);
}

void Run(const Arguments& arguments) {
  mapping::MappingConfig config;
  if (!arguments.config.empty()) config::Load(arguments.config, &config);
  const auto wanted = [&](const std::string& name) {
    return arguments.only.empty() || std::count(arguments.only.begin(), arguments.only.end(), name);
  };
  const Errors usual, rough{0.03, 0.02, 0.001, 0.05};
  PrintHead();
  for (uint64_t seed = arguments.first; seed < arguments.first + arguments.count; ++seed) {
    for (const std::string scenario : {"gym", "forest"}) {
      const bool gym = scenario == "gym";
      Course course =
          Follow("deploy/scenarios/" + scenario + ".yaml", gym ? 2.5 : 1.4, gym ? 1.2 : 1.8);
      if (wanted(scenario)) Fly(scenario, course, usual, seed, config, arguments.trace);
      if (wanted(scenario + "-noisy"))
        Fly(scenario + "-noisy", course, rough, seed, config, arguments.trace);
      Course blind = course;
      blind.blind_period = 10.0;
      blind.blind = 1.0;
      if (wanted(scenario + "-blind"))
        Fly(scenario + "-blind", blind, usual, seed, config, arguments.trace);
      course.frozen = true;
      course.duration = 60.0;
      if (wanted(scenario + "-static"))
        Fly(scenario + "-static", course, rough, seed, config, arguments.trace);
    }
    for (const double speed : {1.0, 2.0, 3.0, 4.0})
      if (wanted("crossing"))
        Fly(fmt::format("crossing-{:.0f}m/s", speed), Crossing(speed), usual, seed, config,
            arguments.trace);
    if (wanted("traffic")) Fly("traffic", Traffic(seed), usual, seed, config, arguments.trace);
  }
  if (wanted("long")) Remember(arguments.length, config);
}

}  // namespace
}  // namespace chase::mapping_stage

int main(int argc, char** argv) {
  chase::mapping_stage::Arguments arguments;
  CLI::App app("Mapping against the truth in the simulator's worlds; run from the project's top.");
  chase::config::AddVersion(&app);
  app.add_option("--seeds", arguments.count, "flights of each kind");
  app.add_option("--first", arguments.first, "first seed");
  app.add_option("--only", arguments.only,
                 "kinds: gym, forest (each also -noisy, -blind, -static), crossing, traffic, long")
      ->check(
          CLI::IsMember({"gym", "gym-noisy", "gym-blind", "gym-static", "forest", "forest-noisy",
                         "forest-blind", "forest-static", "crossing", "traffic", "long"}));
  app.add_option("--config", arguments.config, "file with mapping's config");
  app.add_option("--length", arguments.length, "of the long flight, m");
  app.add_flag("--trace", arguments.trace, "print every listed mover");
  try {
    app.parse(argc, argv);
    chase::mapping_stage::Run(arguments);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "mapping_campaign: {}; see mapping_campaign --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "mapping_campaign: {}\n", e.what());
  }
  return 1;
}
