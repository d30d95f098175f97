// Recall, precision, position error, honesty and time of perception on synthetic flights. The
// argument is the number of seeds; counters as in the README of services/perception.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "perception_world.h"

namespace {

using chase::perception::TargetState;
using chase::perception_test::Fly;
using chase::perception_test::FlyOptions;
using chase::perception_test::Outcome;
using chase::perception_test::World;

constexpr double kSettle = 0.5;  // s before frames count
constexpr double kWrong = 0.5;   // m off the target: another thing
constexpr double k95 = 7.815;    // 95 % of chi square with 3 degrees of freedom

struct Tally {
  int visible = 0, recalled = 0, tracked = 0, wrong = 0, inside = 0;
  double nees = 0.0, squared = 0.0;
  std::vector<double> errors, ms;

  void Add(const Outcome& o) {
    ms.push_back(o.milliseconds);
    const Eigen::Vector3d e = o.estimate.p_WT - o.truth;
    const bool tracking = o.estimate.state == TargetState::kTracking;
    const bool detected = tracking && o.estimate.box.width > 0.0;
    if (o.t > kSettle && o.visible_share >= 0.5 && o.range >= 2.0 && o.range <= 8.0) {
      ++visible;
      recalled += detected && e.norm() < kWrong;
    }
    if (detected) {
      ++tracked;
      wrong += e.norm() > kWrong;
    }
    if (!tracking || o.range < 2.0 || o.range > 6.0) return;
    const double n = e.dot(o.estimate.covariance.ldlt().solve(e));
    errors.push_back(e.norm());
    squared += e.squaredNorm();
    nees += n;
    inside += n < k95;
  }
};

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

double Share(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

void Run(benchmark::State& state, World (*make)(uint32_t)) {
  for (auto _ : state) {
    Tally tally;
    for (uint32_t seed = 1; seed <= static_cast<uint32_t>(state.range(0)); ++seed) {
      FlyOptions options;
      options.duration = 10.0;
      for (const auto& o : Fly(make(seed), {}, options)) tally.Add(o);
    }
    const double n = static_cast<double>(tally.errors.size());
    state.counters["recall"] = Share(tally.recalled, tally.visible);
    state.counters["precision"] = 1.0 - Share(tally.wrong, tally.tracked);
    state.counters["rms_m"] = std::sqrt(Share(tally.squared, n));
    state.counters["p99_m"] = Quantile(tally.errors, 0.99);
    state.counters["nees"] = Share(tally.nees, n);
    state.counters["inside_95"] = Share(tally.inside, n);
    state.counters["frame_ms_p50"] = Quantile(tally.ms, 0.5);
    state.counters["frame_ms_p99"] = Quantile(tally.ms, 0.99);
  }
}

BENCHMARK_CAPTURE(Run, gym, chase::perception_test::GymWorld)
    ->Arg(4)
    ->Arg(20)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Run, forest, chase::perception_test::ForestWorld)
    ->Arg(4)
    ->Arg(20)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
