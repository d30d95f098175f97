// Perception against the simulator's truth: scores over whole flights (`flights/WORLD/SEEDS`, as
// test/perception/README.md says) and the time of a frame (`frames/WORLD`, one flight's frames over
// and over). Counters as in the README of services/perception. Run in the project's root.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

#include "score.h"
#include "stage.h"

namespace {

using chase::perception::Perceiver;
using chase::perception_stage::ConfigFor;
using chase::perception_stage::Fly;
using chase::perception_stage::Play;
using chase::perception_stage::Score;
using chase::perception_stage::Shoot;
using chase::perception_stage::Stage;
using chase::perception_stage::StageOptions;
using chase::perception_stage::Step;

constexpr uint64_t kFirstSeed = 201;
constexpr double kReel = 6.0;  // s of the flight whose frames are timed

StageOptions Options(const std::string& world, uint64_t seed) {
  StageOptions options;
  options.scenario = "deploy/scenarios/" + world + ".yaml";
  options.seed = seed;
  return options;
}

void Report(const Score& score, benchmark::State* state) {
  auto& out = state->counters;
  out["recall"] = score.recall();
  out["precision"] = score.precision();
  out["rms_m"] = score.rms();
  out["p99_m"] = score.p99();
  out["nees"] = score.nees();
  out["inside_95"] = score.coverage();
  out["occlusions"] = score.occlusions();
  out["occluded_said_max_s"] = score.said_max();
  out["found_again_p50_s"] = score.found_quantile(0.5);
  out["found_again_max_s"] = score.found_max();
  out["wrong_after_occlusion"] = score.wrong_after();
  out["frame_ms_p50"] = score.ms_p50();
  out["frame_ms_p99"] = score.ms_p99();
}

void Flights(benchmark::State& state, const std::string& world) {
  for (auto _ : state) {
    Score score;
    for (uint64_t i = 0; i < static_cast<uint64_t>(state.range(0)); ++i) {
      const Stage stage(Options(world, kFirstSeed + i));
      score.Add(Fly(stage, ConfigFor(stage.scenario())));
    }
    Report(score, &state);
  }
}

void Frames(benchmark::State& state, const std::string& world) {
  StageOptions options = Options(world, kFirstSeed);
  options.duration = kReel;
  const Stage stage(options);
  const auto config = ConfigFor(stage.scenario());
  std::vector<Step> reel;
  Shoot(stage, config.rig, [&](Step&& step) { reel.push_back(std::move(step)); });
  std::vector<double> ms;
  for (auto _ : state) {
    Perceiver perceiver(config);
    for (const Step& step : reel)
      if (const auto out = Play(step, &perceiver)) ms.push_back(out->milliseconds);
  }
  if (ms.empty()) return;
  std::sort(ms.begin(), ms.end());
  state.counters["frames"] = static_cast<double>(ms.size());
  state.counters["frame_ms_p50"] = ms[ms.size() / 2];
  state.counters["frame_ms_p99"] = ms[ms.size() * 99 / 100];
  state.SetItemsProcessed(static_cast<int64_t>(ms.size()));
}

BENCHMARK_CAPTURE(Frames, gym, "gym")->Unit(benchmark::kMillisecond)->Name("frames/gym");
BENCHMARK_CAPTURE(Frames, forest, "forest")->Unit(benchmark::kMillisecond)->Name("frames/forest");
BENCHMARK_CAPTURE(Flights, gym, "gym")
    ->Name("flights/gym")
    ->Arg(3)
    ->Arg(20)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(Flights, forest, "forest")
    ->Name("flights/forest")
    ->Arg(3)
    ->Arg(20)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
