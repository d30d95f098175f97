// Accuracy of the forecast: root mean squares of the error after 0.5, 1 and 2.5 s for targets seen
// at 20 Hz with 4 cm of noise, beside least-squares lines (constant velocity, over 0.5 and 1 s) and
// a parabola (constant acceleration, over 2 s). The times are in prediction_rows.cpp.
#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

#include "deploy/worlds/worlds.h"
#include "test/bench/prediction_courses.h"

namespace chase::prediction {
namespace {

constexpr double kSigma = 0.04;  // m
constexpr uint64_t kSeed = 100;

void Count(const char* who, const Errors& errors, benchmark::State* state) {
  const char* after[] = {"_0.5s_m", "_1s_m", "_2.5s_m"};
  for (int k = 0; k < 3; ++k) state->counters[std::string(who) + after[k]] = errors[k];
}

void Accuracy(benchmark::State& state, const std::function<std::vector<Course>()>& make) {
  AccuracyResult pooled;
  for (auto _ : state) {
    std::vector<AccuracyResult> results;
    for (const Course& course : make())
      for (uint64_t run = 0; run < 3; ++run)
        results.push_back(MeasureAccuracy(course, {}, {}, kSigma, kSeed + run));
    pooled = Pooled(results);
  }
  state.counters["forecasts"] = pooled.forecasts;
  Count("ours", pooled.ours, &state);
  Count("line_0.5s", pooled.velocity_short, &state);
  Count("line_1s", pooled.velocity_long, &state);
  Count("parabola", pooled.acceleration, &state);
}

std::vector<Course> Twelve(int first, int last) {
  std::vector<Course> courses;
  for (int k = first; k <= last; ++k) courses.push_back(TwelveCourse(k));
  return courses;
}

std::vector<Course> Drives() {
  return {DriveCourse(0), DriveCourse(1), DriveCourse(2), DriveCourse(3), DriveCourse(4)};
}

// The targets of random worlds of every kind.
std::vector<Course> Worlds(uint64_t first, uint64_t last) {
  std::vector<Course> courses;
  for (const auto& kind : worlds::Kinds())
    for (uint64_t seed = first; seed <= last; ++seed)
      courses.push_back(WorldCourse(kind.name, seed));
  return courses;
}

#define ACCURACY(name, ...)                                                          \
  BENCHMARK_CAPTURE(Accuracy, name, [] { return std::vector<Course>(__VA_ARGS__); }) \
      ->Iterations(1)                                                                \
      ->Unit(benchmark::kMillisecond)

ACCURACY(straight, {StraightCourse()});
ACCURACY(drive, Drives());
ACCURACY(gym, {GymCourse()});
ACCURACY(corridor, {CorridorCourse()});
ACCURACY(S1_to_S6_tuned_on, Twelve(1, 6));
ACCURACY(S7_to_S12, Twelve(7, 12));
ACCURACY(worlds_1_to_4, Worlds(1, 4));
ACCURACY(worlds_1001_to_1004_chosen_on, Worlds(1001, 1004));

}  // namespace
}  // namespace chase::prediction
