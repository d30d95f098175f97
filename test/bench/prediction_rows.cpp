// Rows predict/N_v x N_o x obstacles: time of a prediction, one core, 500 seeded instances each,
// full 3x3 shapes, all obstacles moving, certified; and in how many of 200 further instances the
// winner costs what exhaustive search with exact root counting finds: of the same size in the first
// row, of 5 observations in the others. Part of bench_prediction and of bench_planning.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "services/prediction/reference.h"
#include "services/prediction/table_search.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

constexpr int kInstances = 500, kCompared = 200;
constexpr int kFewObservations = 5;  // 3125 candidates: listed in no time

struct Row {
  int samples, observations, obstacles;
  bool all_moving;
  int degree;
  int compared_observations;  ///< of the instances that exhaustive search lists
};

// Processor time of this process: what others run on the machine does not count.
double ProcessorTimeUs() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<size_t>(q * static_cast<double>(values.size())))];
}

PredictorConfig ConfigOf(const Row& row) {
  PredictorConfig config;
  config.samples = row.samples;
  config.degree = row.degree;
  return config;
}

PredictRequest Instance(const Row& row, int seed, int observations) {
  InstanceGenerator generator(static_cast<uint64_t>(seed));
  generator.set_all_moving(row.all_moving);
  return generator.Make(observations, row.obstacles);
}

double ShareOfSameWinners(const Row& row) {
  const PredictorConfig config = ConfigOf(row);
  int same = 0;
  for (int seed = 10000; seed < 10000 + kCompared; ++seed) {
    const PredictRequest request = Instance(row, seed, row.compared_observations);
    const CandidateSet candidates(config, request.observations, request.now);
    const auto obstacles = PrepareObstacles(request.obstacles, request.observations, candidates,
                                            request.now, 0.0, config);
    const SearchResult expected = ReferenceSearch(candidates, obstacles);
    const SearchResult found = TableSearch(candidates).Run(obstacles, config.visit_limit);
    same += found.complete && found.found() == expected.found() &&
            (!found.found() || std::abs(found.cost - expected.cost) <= 1e-9 * expected.cost);
  }
  return static_cast<double>(same) / kCompared;
}

void Predict(benchmark::State& state, const Row& row) {
  const Predictor predictor(ConfigOf(row));
  std::vector<PredictRequest> requests;
  for (int seed = 0; seed < kInstances; ++seed)
    requests.push_back(Instance(row, seed, row.observations));
  predictor.Predict(requests.front());
  std::vector<double> us;
  double colliding = 0.0, gap = 0.0;
  for (auto _ : state) {
    us.clear();
    colliding = gap = 0.0;
    for (const PredictRequest& request : requests) {
      const double start = ProcessorTimeUs();
      const PredictResult result = predictor.Predict(request);
      us.push_back(ProcessorTimeUs() - start);
      colliding += result.verdict == PredictResult::Verdict::kColliding;
      gap = std::max(gap, result.gap);
    }
  }
  state.counters["p50_us"] = Quantile(us, 0.5);
  state.counters["p99_us"] = Quantile(us, 0.99);
  state.counters["max_us"] = Quantile(us, 1.0);
  state.counters["share_colliding"] = colliding / kInstances;
  state.counters["max_gap"] = gap;
  state.counters["same_winner"] = ShareOfSameWinners(row);
}

const int kRegistered = [] {
  const Row rows[] = {{5, 8, 10, true, 3, 8},
                      {5, 8, 10, false, 3, kFewObservations},
                      {5, 8, 10, true, 5, kFewObservations},
                      {5, 8, 20, true, 3, kFewObservations},
                      {5, 6, 10, true, 3, kFewObservations}};
  for (const Row& row : rows) {
    std::string name = "predict/" + std::to_string(row.samples) + "x" +
                       std::to_string(row.observations) + "x" + std::to_string(row.obstacles);
    if (row.degree != 3) name += "/degree" + std::to_string(row.degree);
    if (!row.all_moving) name += "/half_static";
    benchmark::RegisterBenchmark(name.c_str(), Predict, row)
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  }
  return 0;
}();

}  // namespace
}  // namespace chase::prediction
