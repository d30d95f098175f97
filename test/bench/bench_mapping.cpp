// Mapping of a synthetic gym and forest: time a sweep up to the obstacle list, its ratio to plain
// OctoMap insertion in the same run, coverage, wrongly blocked volume, counts and false movers.
#include <benchmark/benchmark.h>
#include <octomap/octomap.h>
#include <time.h>

#include <algorithm>
#include <random>
#include <vector>

#include "mapping_metrics.h"
#include "mapping_world.h"
#include "services/mapping/mapper.h"

namespace {

using chase::mapping::Mapper;
using chase::mapping::MappingConfig;
using namespace chase::mapping::testing;

/// Processor time of this thread, ms: other processes on the machine do not count.
double Clock() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double Milliseconds(double since) { return Clock() - since; }

double Quantile(std::vector<double> x, double q) {
  std::sort(x.begin(), x.end());
  return x[static_cast<size_t>(q * static_cast<double>(x.size() - 1))];
}

double PlainOctomap(const std::vector<chase::mapping::Sweep>& sweeps, const MappingConfig& config) {
  octomap::OcTree tree(config.grid.resolution);
  std::vector<double> times;
  for (size_t i = 0; i < sweeps.size(); i += 20) {
    octomap::Pointcloud cloud;
    for (const auto& p : sweeps[i].points) cloud.push_back(p.x(), p.y(), p.z());
    const octomap::point3d origin(static_cast<float>(sweeps[i].origin.x()),
                                  static_cast<float>(sweeps[i].origin.y()),
                                  static_cast<float>(sweeps[i].origin.z()));
    const double start = Clock();
    tree.insertPointCloud(cloud, origin, config.grid.range);
    times.push_back(Milliseconds(start));
  }
  return Quantile(times, 0.5);
}

struct Flight {
  World world;
  std::vector<chase::mapping::Sweep> sweeps;
  std::vector<Truth> truths;
  std::vector<Eigen::Vector3d> places;
};

Flight FlyGym(int n, const SensorNoise& noise) {
  Flight flight;
  flight.world = Gym();
  std::mt19937 random(7);
  for (int i = 0; i < n; ++i) {
    flight.places.push_back(GymFlight(0.1 * i));
    flight.truths.emplace_back();
    flight.sweeps.push_back(
        Scan(flight.world, flight.places.back(), 0.1 * i, noise, &random, &flight.truths.back()));
  }
  return flight;
}

Flight FlyForest(int n, const SensorNoise& noise) {
  Flight flight;
  flight.world = Forest(70.0, 300, 3);
  std::mt19937 random(8);
  for (int i = 0; i < n; ++i) {
    const double x = 5.0 + 0.3 * i;
    flight.places.push_back({x, 35.0 + 0.8 * std::sin(0.3 * x), 1.8});
    flight.truths.emplace_back();
    flight.sweeps.push_back(
        Scan(flight.world, flight.places.back(), 0.1 * i, noise, &random, &flight.truths.back()));
  }
  return flight;
}

void Run(benchmark::State& state, const Flight& flight) {
  const MappingConfig config;
  for (auto _ : state) {
    Mapper mapper(config);
    HitCounter hits;
    std::vector<double> times, tree_times;
    double worst_coverage = 1.0, worst_blocked = 0.0, coverage_sum = 0.0;
    int most = 0, movers = 0, checks = 0;
    for (size_t i = 0; i < flight.sweeps.size(); ++i) {
      double start = Clock();
      const auto list = mapper.Insert(flight.sweeps[i]);
      times.push_back(Milliseconds(start));
      start = Clock();
      mapper.UpdateTree();
      tree_times.push_back(Milliseconds(start));
      hits.Add(flight.truths[i]);
      most = std::max(most, list.n_static);
      movers += list.n_moving;
      if (i % 25 != 24) continue;
      const Eigen::Vector3d at = flight.places[i];
      const double t = flight.sweeps[i].t;
      const double coverage = hits.Coverage(list.obstacles, at, 8.0, t);
      const Eigen::Vector2d low = (at.head<2>().array() - 5.0), high = low.array() + 10.0;
      ++checks;
      coverage_sum += coverage;
      worst_coverage = std::min(worst_coverage, coverage);
      worst_blocked = std::max(worst_blocked, Blocked(flight.world, list.obstacles, low, high, t));
    }
    const double plain = PlainOctomap(flight.sweeps, config);
    int occupied = 0;
    const double start = Clock();
    const auto bytes = mapper.WriteTree(&occupied);
    state.counters["write_ms"] = Milliseconds(start);
    state.counters["map_kB"] = static_cast<double>(bytes.size()) / 1e3;
    state.counters["median_ms"] = Quantile(times, 0.5);
    state.counters["p99_ms"] = Quantile(times, 0.99);
    state.counters["tree_p99_ms"] = Quantile(tree_times, 0.99);
    state.counters["octomap_ms"] = plain;
    state.counters["ratio"] = plain / Quantile(times, 0.5);
    state.counters["coverage_mean"] = coverage_sum / std::max(1, checks);
    state.counters["coverage_min"] = worst_coverage;
    state.counters["blocked_max"] = worst_blocked;
    state.counters["ellipsoids"] = most;
    state.counters["false_movers"] = movers;
    state.counters["MiB"] = static_cast<double>(mapper.Bytes()) / (1 << 20);
  }
}

void BM_Gym(benchmark::State& state) { Run(state, FlyGym(300, {0.02, 0.01})); }
void BM_GymNoisy(benchmark::State& state) { Run(state, FlyGym(300, {0.03, 0.02})); }
void BM_Forest(benchmark::State& state) { Run(state, FlyForest(180, {0.02, 0.01})); }

BENCHMARK(BM_Gym)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_GymNoisy)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Forest)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
