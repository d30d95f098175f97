// Odometry in the simulator's worlds, in one process. CHASE_ODOMETRY_LAYOUTS=200 asks for more of
// the random ones, CHASE_ODOMETRY_FIRST for other seeds; figures are printed then.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "common/world/random.h"
#include "test/odometry/live_trial.h"

namespace chase::odometry {
namespace {

using trial::FlyLive;
using trial::LiveFigures;
using trial::LiveOptions;

int Environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

int Layouts(int usual) { return Environment("CHASE_ODOMETRY_LAYOUTS", usual); }

LiveFigures Shown(const std::string& what, const LiveFigures& figures) {
  if (std::getenv("CHASE_ODOMETRY_LAYOUTS"))
    fmt::print("{{\"what\":\"{}\",{}}}\n", what, trial::Text(figures));
  std::fflush(stdout);
  return figures;
}

/// From power-on through take-off into the first metres of way, whatever grows there.
TEST(OdometryLive, StartsAnywhere) {
  const int first = Environment("CHASE_ODOMETRY_FIRST", 7);
  for (int seed = first; seed < first + Layouts(3); ++seed) {
    world::Random random(static_cast<uint64_t>(seed), 5);
    const int trees = seed % 8 == 0 ? 0 : static_cast<int>(random.Uniform(0.0, 241.0));
    const double roughness = random.Uniform(0.0, 0.3);
    const std::string what =
        fmt::format("seed {} trees {} roughness {:.2f}", seed, trees, roughness);
    LiveOptions options;
    options.seed = seed;
    options.duration = 14.0;
    const LiveFigures figures =
        Shown(what, FlyLive(trial::Meadow(trees, roughness, static_cast<uint64_t>(seed)), options));
    EXPECT_EQ(figures.refused, 0) << what;
    EXPECT_EQ(figures.lost, 0) << what;
    EXPECT_EQ(figures.epochs, 0) << what;
    if (trees >= 10) {
      EXPECT_LT(figures.aligned, 0.05) << what;
    }
  }
}

}  // namespace
}  // namespace chase::odometry
