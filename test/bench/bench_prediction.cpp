// Time of a prediction, one core: 500 seeded instances per row, full 3x3 shapes, half of the
// obstacles moving, certified. Counters in microseconds over the instances.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <vector>

#include "test/bench/prediction_study.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

constexpr int kInstances = 500;

struct Sample {
  double us;
  PredictResult result;
};

// Processor time of this process: what others run on the machine does not count.
double ProcessorTimeUs() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

Sample TimeOne(const Predictor& predictor, const PredictRequest& request) {
  const double start = ProcessorTimeUs();
  PredictResult result = predictor.Predict(request);
  return {ProcessorTimeUs() - start, std::move(result)};
}

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<size_t>(q * static_cast<double>(values.size())))];
}

void Report(const std::vector<Sample>& samples, benchmark::State* state) {
  std::vector<double> us;
  double blocked = 0, first = 0, incomplete = 0, gap = 0;
  for (const Sample& s : samples) {
    us.push_back(s.us);
    blocked += s.result.verdict == PredictResult::Verdict::kColliding;
    first += s.result.checked == 1;
    incomplete += s.result.gap > 0.0;
    gap = std::max(gap, s.result.gap);
  }
  const double n = static_cast<double>(samples.size());
  state->counters["p50_us"] = Quantile(us, 0.5);
  state->counters["p99_us"] = Quantile(us, 0.99);
  state->counters["max_us"] = Quantile(us, 1.0);
  state->counters["share_colliding"] = blocked / n;
  state->counters["share_first_clear"] = first / n;
  state->counters["share_incomplete"] = incomplete / n;
  state->counters["max_gap"] = gap;
}

// Arguments: N_v, N_o, obstacles, all of them moving or every other one, degree.
void BM_Predict(benchmark::State& state) {
  PredictorConfig config;
  config.samples = static_cast<int>(state.range(0));
  config.degree = static_cast<int>(state.range(4));
  const Predictor predictor(config);
  std::vector<PredictRequest> requests;
  for (int seed = 0; seed < kInstances; ++seed) {
    InstanceGenerator generator(static_cast<uint64_t>(seed));
    generator.set_all_moving(state.range(3) != 0);
    requests.push_back(
        generator.Make(static_cast<int>(state.range(1)), static_cast<int>(state.range(2))));
  }
  predictor.Predict(requests.front());
  for (auto _ : state) {
    std::vector<Sample> samples;
    for (const PredictRequest& request : requests) samples.push_back(TimeOne(predictor, request));
    Report(samples, &state);
  }
}
BENCHMARK(BM_Predict)
    ->ArgNames({"n_v", "n_o", "obstacles", "all_moving", "degree"})
    ->Args({5, 8, 10, 1, 3})
    ->Args({5, 8, 10, 0, 3})
    ->Args({5, 8, 10, 1, 5})
    ->Args({5, 8, 20, 0, 3})
    ->Args({5, 6, 10, 1, 3})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

// Accuracy for a target seen at 20 Hz with 4 cm of noise, against the least-squares line.
void BM_Accuracy(benchmark::State& state) {
  for (auto _ : state) {
    const StudyResult study = StudyAccuracy({}, {}, 0.04, 6);
    const char* names[] = {"rms_0.5s_m", "rms_1s_m", "rms_2.5s_m"};
    for (int k = 0; k < 3; ++k) {
      state.counters[names[k]] = study.ours[k];
      state.counters[std::string("line_") + names[k]] = study.constant_velocity[k];
    }
  }
}
BENCHMARK(BM_Accuracy)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace chase::prediction

BENCHMARK_MAIN();
