#include <benchmark/benchmark.h>

#include "services/simulator/simulator.h"

namespace chase::simulator {
namespace {

/// One simulated second in 5 ms steps, hovering with the target in view.
void SimulatedSecond(benchmark::State& state, const char* scenario, double lidar_rate,
                     double camera_rate) {
  SimulatorConfig config;
  config.lidar.rate = lidar_rate;
  config.camera.rate = camera_rate;
  auto world = world::LoadScenario(scenario);
  world.chaser.start.z() += 1.2;
  Simulator simulator(world, config);
  AttitudeSetpoint hover;
  hover.thrust = kGravity / (1.0 + config.vehicle.thrust_error);
  hover.orientation =
      Eigen::AngleAxisd(world.chaser.yaw_deg * 0.017453292519943295, Eigen::Vector3d::UnitZ());
  long step = 0;
  for (auto _ : state)
    for (int i = 0; i < 200; ++i, ++step) {
      const double t = 0.005 * static_cast<double>(step);
      simulator.SetSetpoint(hover, t);
      benchmark::DoNotOptimize(simulator.Advance(t));
    }
}

constexpr char kGym[] = CHASE_SOURCE_DIR "/deploy/scenarios/gym.yaml";
constexpr char kForest[] = CHASE_SOURCE_DIR "/deploy/scenarios/forest.yaml";

void GymPhysics(benchmark::State& state) { SimulatedSecond(state, kGym, 0.0, 0.0); }
void GymLidar(benchmark::State& state) { SimulatedSecond(state, kGym, 10.0, 0.0); }
void GymCamera(benchmark::State& state) { SimulatedSecond(state, kGym, 0.0, 20.0); }
void GymAll(benchmark::State& state) { SimulatedSecond(state, kGym, 10.0, 20.0); }
void ForestLidar(benchmark::State& state) { SimulatedSecond(state, kForest, 10.0, 0.0); }
void ForestAll(benchmark::State& state) { SimulatedSecond(state, kForest, 10.0, 20.0); }

BENCHMARK(GymPhysics)->Unit(benchmark::kMillisecond);
BENCHMARK(GymLidar)->Unit(benchmark::kMillisecond);
BENCHMARK(GymCamera)->Unit(benchmark::kMillisecond);
BENCHMARK(GymAll)->Unit(benchmark::kMillisecond);
BENCHMARK(ForestLidar)->Unit(benchmark::kMillisecond);
BENCHMARK(ForestAll)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace chase::simulator
