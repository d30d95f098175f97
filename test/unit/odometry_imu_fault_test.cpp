// Sensors that go wrong in flight: biases that step, readings that jump, stamps that step.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "common/world/random.h"
#include "test/odometry/live_trial.h"

namespace chase::odometry {
namespace {

using trial::FlyLive;
using trial::LiveFigures;
using trial::LiveOptions;

int Layouts(int usual) {
  const char* text = std::getenv("CHASE_ODOMETRY_LAYOUTS");
  return text ? std::atoi(text) : usual;
}

LiveFigures Flown(const std::string& what, uint64_t seed, const LiveOptions& options) {
  world::Random random(seed, 9);
  const int trees = static_cast<int>(random.Uniform(30.0, 200.0));
  const LiveFigures figures =
      FlyLive(trial::Meadow(trees, random.Uniform(0.0, 0.2), seed), options);
  if (std::getenv("CHASE_ODOMETRY_LAYOUTS"))
    fmt::print("{{\"what\":\"{}\",\"seed\":{},{}}}\n", what, seed, trial::Text(figures));
  return figures;
}

LiveOptions From(int seed) {
  LiveOptions options;
  options.seed = seed;
  options.duration = 16.0;
  options.judge_from = 10.0;
  return options;
}

void ExpectGood(const LiveFigures& figures, const std::string& what) {
  EXPECT_LT(figures.worst, 0.1) << what;
  EXPECT_EQ(figures.lost, 0) << what;
  EXPECT_EQ(figures.epochs, 0) << what;
}

TEST(OdometryImuFault, SpikesAreLeftOut) {
  for (int seed = 1; seed <= Layouts(2); ++seed)
    for (const double size : {0.3, 1.0})
      for (const int length : {1, 6}) {
        if (size < 1.0 && length > 1) continue;  // several that agree are a motion
        LiveOptions options = From(seed);
        options.spikes_from = 10.5;
        options.spike_size = size;
        options.spike_length = length;
        const std::string what = fmt::format("spikes {} x {} ", size, length);
        ExpectGood(Flown(what, static_cast<uint64_t>(seed), options), what);
      }
}

TEST(OdometryImuFault, BiasesThatJumpAreLearntAnew) {
  struct Jump {
    double gyro, accel;  // rad/s, m/s^2
  };
  for (int seed = 1; seed <= Layouts(2); ++seed)
    for (const Jump jump : {Jump{0.015, 0.25}, {-0.01, 0.1}, {0.0, -0.25}, {0.005, 0.0}}) {
      LiveOptions options = From(seed);
      options.jump_from = 10.5;
      options.gyro_jump = jump.gyro;
      options.accel_jump = jump.accel;
      const std::string what = fmt::format("jump by {} rad/s, {} m/s^2 ", jump.gyro, jump.accel);
      const LiveFigures figures = Flown(what, static_cast<uint64_t>(seed), options);
      ExpectGood(figures, what);
      EXPECT_LT(figures.worst_velocity, 0.2) << what;
    }
}

TEST(OdometryImuFault, StampsOfTheLidarThatStepCostNoSweep) {
  for (int seed = 1; seed <= Layouts(1); ++seed)
    for (const double step : {-60.0, -1.0, 1.0, 60.0}) {
      LiveOptions options = From(seed);
      options.clock_from = 10.5;
      options.clock_step = step;
      const std::string what = fmt::format("stamps off by {} s ", step);
      const LiveFigures figures = Flown(what, static_cast<uint64_t>(seed), options);
      ExpectGood(figures, what);
      EXPECT_LE(figures.refused, 0) << what;
      EXPECT_GE(figures.sweeps, 150) << what;
    }
}

TEST(OdometryImuFault, SamplesThatComeLateAreWaitedFor) {
  for (int seed = 1; seed <= Layouts(2); ++seed)
    for (const double delay : {0.1, 0.3}) {
      LiveOptions options = From(seed);
      options.delay_from = 10.5;
      options.imu_delay = delay;
      const std::string what = fmt::format("samples {} s late ", delay);
      const LiveFigures figures = Flown(what, static_cast<uint64_t>(seed), options);
      ExpectGood(figures, what);
      EXPECT_LT(figures.worst_velocity, 0.2) << what;
    }
}

}  // namespace
}  // namespace chase::odometry
