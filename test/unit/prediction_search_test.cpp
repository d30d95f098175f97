// The searches against exhaustive enumeration with exact root counting.
#include <gtest/gtest.h>

#include <cmath>

#include "services/prediction/branch_search.h"
#include "services/prediction/reference.h"
#include "services/prediction/table_search.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

struct Problem {
  PredictRequest request;
  CandidateSet candidates;
  std::vector<HorizonObstacle> obstacles;
};

Problem MakeProblem(const PredictorConfig& config, const PredictRequest& request) {
  CandidateSet candidates(config, request.observations, request.now);
  auto obstacles = PrepareObstacles(request.obstacles, request.observations, candidates,
                                    request.now, 0.1, config);
  return {request, std::move(candidates), std::move(obstacles)};
}

void ExpectSameOptimum(const SearchResult& found, const SearchResult& expected) {
  ASSERT_EQ(found.found(), expected.found());
  EXPECT_TRUE(found.complete);
  if (expected.found()) {
    EXPECT_NEAR(found.cost, expected.cost, 1e-9 * (1.0 + expected.cost));
  }
}

struct Tally {
  int clear = 0, shifted = 0, blocked = 0;
  void Add(const SearchResult& expected) {
    clear += expected.found() && expected.checked == 1;
    shifted += expected.found() && expected.checked > 1;
    blocked += !expected.found();
  }
};

TEST(PredictionSearch, EqualsBruteForceOnSmallInstances) {
  Tally tally;
  for (int seed = 0; seed < 360; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(static_cast<uint64_t>(seed));
    PredictorConfig config;
    config.samples = seed % 3 == 0 ? 4 : 5;
    config.degree = seed % 4 == 3 ? 5 : 3;
    config.planar = seed % 5 != 4;
    config.motion.steady = seed % 2 == 0;
    if (seed % 7 < 4) {  // a narrow fan, which is blocked more often
      config.spread = 0.05;
      config.contour_sigmas = 2.0;
      config.fit_weight = 30.0;
    }
    const Problem p = MakeProblem(
        config, generator.Make(seed % 8 == 7 ? 5 : 3 + seed / 2 % 2, 10, seed / 2 % 2 ? 0.7 : 0.4));
    const SearchResult expected = ReferenceSearch(p.candidates, p.obstacles);
    tally.Add(expected);
    ExpectSameOptimum(TableSearch(p.candidates).Run(p.obstacles, 1 << 30), expected);
    if (seed % 3 == 0) {
      ExpectSameOptimum(BranchSearch(p.candidates, p.obstacles, 1000000), expected);
    }
  }
  // The instances must exercise all three outcomes.
  EXPECT_GE(tally.clear, 20);
  EXPECT_GE(tally.shifted, 20);
  EXPECT_GE(tally.blocked, 5);
  std::printf("clear %d, shifted %d, blocked %d\n", tally.clear, tally.shifted, tally.blocked);
}

TEST(PredictionSearch, EqualsBruteForceOnFullSizeInstances) {
  for (int seed = 1000; seed < 1010; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(static_cast<uint64_t>(seed));
    PredictorConfig config;
    config.motion.steady = seed % 3 != 0;
    const Problem p = MakeProblem(config, generator.Make(8, 10, 0.5));
    const SearchResult expected = ReferenceSearch(p.candidates, p.obstacles);
    ExpectSameOptimum(TableSearch(p.candidates).Run(p.obstacles, 1 << 30), expected);
  }
}

// The searches take the same way at every vector width, not only to the same end.
TEST(PredictionSearch, DoesNotDependOnTheVectorWidth) {
  for (int seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(static_cast<uint64_t>(seed));
    PredictorConfig config;
    config.degree = 3 + seed % 3;
    const Problem p = MakeProblem(config, generator.Make(seed % 4 ? 6 : 8, 10, 0.5));
    const SearchResult narrow =
        TableSearch(p.candidates, BaselineKernels()).Run(p.obstacles, 1 << 30);
    const SearchResult best = TableSearch(p.candidates, BestKernels()).Run(p.obstacles, 1 << 30);
    EXPECT_EQ(narrow.choice, best.choice);
    EXPECT_EQ(narrow.cost, best.cost);
    EXPECT_EQ(narrow.checked, best.checked);
    EXPECT_EQ(narrow.nodes, best.nodes);
  }
}

}  // namespace
}  // namespace chase::prediction
