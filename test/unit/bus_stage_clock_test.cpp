#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "common/bus/stage_clock.h"

namespace chase::bus {
namespace {

/// Durations over nine decades, against what sorting them says.
TEST(StageClock, PercentilesOfAHistogramAreThoseOfTheSamples) {
  std::mt19937 random(3);
  for (const double spread : {1e-3, 0.5, 3.0}) {
    std::lognormal_distribution<double> ms(1.0, spread);
    StageClock::Histogram histogram;
    std::vector<double> samples;
    for (int i = 0; i < 5000; ++i) histogram.Add(samples.emplace_back(ms(random)));
    std::sort(samples.begin(), samples.end());
    const double mean = std::accumulate(samples.begin(), samples.end(), 0.0) / 5000;
    const StageClock::Summary s = histogram.Summarise();
    EXPECT_EQ(s.count, 5000);
    EXPECT_NEAR(s.mean_ms, mean, 1e-9 * mean) << "spread " << spread;
    EXPECT_NEAR(s.p50_ms, samples[2500], 0.011 * samples[2500]) << "spread " << spread;
    EXPECT_NEAR(s.p99_ms, samples[4950], 0.011 * samples[4950]) << "spread " << spread;
    EXPECT_EQ(s.max_ms, samples.back());
  }
}

TEST(StageClock, DurationsBeyondTheBinsCountInTheLast) {
  StageClock::Histogram histogram;
  EXPECT_EQ(histogram.Summarise().count, 0);
  histogram.Add(std::nan(""));
  EXPECT_EQ(histogram.Summarise().count, 0);
  histogram.Add(3.0);
  EXPECT_NEAR(histogram.Summarise().p50_ms, 3.0, 0.033);
  EXPECT_LE(histogram.Summarise().p99_ms, 3.0);
  histogram.Add(1e9);
  EXPECT_NEAR(histogram.Summarise().p99_ms, 42949.7, 500.0);
  EXPECT_EQ(histogram.Summarise().max_ms, 1e9);
}

}  // namespace
}  // namespace chase::bus
