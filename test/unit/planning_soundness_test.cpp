// The certificate against exact arithmetic and dense sampling, the search against exhaustive ones,
// the vector kernels against each other.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "services/planning/certificate.h"
#include "services/planning/cost.h"
#include "services/planning/fast_search.h"
#include "services/planning/field_of_view.h"
#include "services/planning/plan_proof.h"
#include "services/planning/reference_search.h"
#include "services/planning/refinement.h"
#include "services/planning/skeletons.h"
#include "test/unit/planning_instances.h"

namespace chase::planning {
namespace {

using Random = std::mt19937;

double Uniform(Random& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

Curve RandomCurve(Random& g, int degree, double size) {
  Curve c(degree + 1, 3);
  for (Eigen::Index i = 0; i < c.size(); ++i) c.data()[i] = Uniform(g, -size, size);
  return c;
}

Eigen::Matrix3d RandomShape(Random& g) {
  Eigen::Matrix3d A;
  for (int i = 0; i < 9; ++i) A.data()[i] = Uniform(g, -1.0, 1.0);
  const Eigen::Matrix3d R = A * A.transpose() + 0.05 * Eigen::Matrix3d::Identity();
  return 0.5 * (R + R.transpose());
}

/// One plan, one target, one obstacle.
struct Pair {
  Problem problem;
  Curve plan;
};

Pair RandomPair(Random& g) {
  Pair pair;
  Problem& p = pair.problem;
  pair.plan = RandomCurve(g, 5 + static_cast<int>(g() % 2), 2.0);
  p.degree = static_cast<int>(pair.plan.rows()) - 1;
  p.target = RandomCurve(g, 1 + static_cast<int>(g() % 5), 2.0);
  p.start = pair.plan.topRows(4);
  Ellipsoid e;
  e.center = RandomCurve(g, static_cast<int>(g() % 3), 1.0);
  // Away from both starts, or most pairs would meet at once.
  e.center.row(0) += Eigen::RowVector3d(Uniform(g, -4, 4), Uniform(g, -4, 4), Uniform(g, -4, 4));
  e.safety = e.sight = RandomShape(g);
  p.obstacles = {e};
  return pair;
}

double Safety(const Pair& pair, double tau) {
  const Ellipsoid& e = pair.problem.obstacles[0];
  const Eigen::Vector3d d = Evaluate(pair.plan, tau) - Evaluate(e.center, tau);
  return d.dot(e.safety * d);
}

double Sight(const Pair& pair, double tau) {
  const Ellipsoid& e = pair.problem.obstacles[0];
  return world::SegmentSquaredDistance(Evaluate(pair.plan, tau), Evaluate(pair.problem.target, tau),
                                       Evaluate(e.center, tau), e.sight);
}

/// The least value over [0,1] by sampling and golden section.
template <class F>
double Least(F&& f) {
  double best = 0.0, value = HUGE_VAL;
  for (int i = 0; i <= 400; ++i)
    if (f(i / 400.0) < value) value = f(best = i / 400.0);
  double a = std::max(0.0, best - 1 / 400.0), b = std::min(1.0, best + 1 / 400.0);
  for (int i = 0; i < 60; ++i) {
    const double x = a + 0.381966 * (b - a), y = b - 0.381966 * (b - a);
    f(x) < f(y) ? b = y : a = x;
  }
  return std::min({value, f(0.5 * (a + b)), f(a), f(b)});
}

bool IsFeasibleExactly(const Pair& pair, bool exact, double sight_from) {
  const Ellipsoid& e = pair.problem.obstacles[0];
  return IsSafe(pair.plan, e, Arithmetic::kExactSturm) &&
         IsInSight(pair.plan, pair.problem.target, e, sight_from, exact, Arithmetic::kExactSturm);
}

struct Tally {
  int accepted = 0, refused = 0, false_accepts = 0, false_refusals = 0, exact = 0;

  void Take(const Pair& pair, bool exact_sight, double sight_from) {
    PlanProof proof;
    proof.Reset(pair.problem, sight_from, exact_sight);
    const bool holds = proof.Holds(pair.plan),
               truth = IsFeasibleExactly(pair, exact_sight, sight_from);
    exact += proof.exact();
    (holds ? accepted : refused)++;
    false_accepts += holds && !truth;
    false_refusals += !holds && truth;
  }
  void ExpectRight() const {
    EXPECT_EQ(false_accepts, 0);
    EXPECT_EQ(false_refusals, 0);
  }
};

TEST(PlanProof, DecidesRandomPairsAsExactArithmeticDoes) {
  Random g(1);
  Tally tally;
  for (int i = 0; i < 4000; ++i) tally.Take(RandomPair(g), i % 2 == 0, i % 4 == 0 ? 0.0 : 1.0);
  tally.ExpectRight();
  EXPECT_GT(tally.accepted, 300);
  EXPECT_GT(tally.refused, 300);
}

// Shapes scaled until plan or line of sight just touches them, inside or at an end, up to a few
// roundings either way. One in 32 asks for sight, whose exact test is slow.
TEST(PlanProof, DecidesNearTangenciesAsExactArithmeticDoes) {
  Random g(2);
  Tally tally;
  constexpr double kGaps[] = {0.0, 1e-16, -1e-16, 1e-15, -1e-15, 1e-13, -1e-13, 1e-9, -1e-9};
  for (int done = 0; done < 8000;) {
    Pair pair = RandomPair(g);
    Ellipsoid& e = pair.problem.obstacles[0];
    const bool sight = done % 32 == 31;
    const auto value = [&](double t) { return sight ? Sight(pair, t) : Safety(pair, t); };
    const int place = done / 32 % 4;
    const double least = place == 0 ? value(0.0) : place == 1 ? value(1.0) : Least(value);
    if (!(least > 1e-3)) continue;
    e.safety *= (1.0 + kGaps[done % 9]) / least;
    e.sight = e.safety;
    tally.Take(pair, done % 64 == 31, sight ? 0.0 : 1.0);
    ++done;
  }
  tally.ExpectRight();
  EXPECT_GT(tally.accepted, 500);
  EXPECT_GT(tally.refused, 1000);
  EXPECT_GT(tally.exact, 500) << "hardly any needed exact arithmetic: not near enough";
}

TEST(PlanProof, SafetyAndSightMayAskOfDifferentShapesAndTimes) {
  Random g(3);
  int accepted = 0;
  for (int i = 0; i < 400; ++i) {
    Pair pair = RandomPair(g);
    Ellipsoid& e = pair.problem.obstacles[0];
    e.sight = (0.5 + 0.25 * (i % 4)) * e.safety;
    e.safety_from = i % 3 == 0 ? 0.25 : 0.0;
    e.sight_from = i % 5 == 0 ? 0.5 : 0.0;
    const double from = 0.25 * (i % 5);
    PlanProof proof;
    proof.Reset(pair.problem, from, true);
    const bool truth =
        IsSafe(pair.plan, e, Arithmetic::kExactSturm) &&
        IsInSight(pair.plan, pair.problem.target, e, from, true, Arithmetic::kExactSturm);
    ASSERT_EQ(proof.Holds(pair.plan), truth) << i;
    accepted += truth;
  }
  EXPECT_GT(accepted, 40);
}

TEST(PlanProof, NothingHoldsForShapesThatAreNone) {
  Random g(4);
  Pair pair = RandomPair(g);
  Ellipsoid& e = pair.problem.obstacles[0];
  for (const double bad : {0.0, -1.0, static_cast<double>(NAN), HUGE_VAL}) {
    e.safety = e.sight = bad * Eigen::Matrix3d::Identity();
    PlanProof proof;
    proof.Reset(pair.problem, 0.0, true);
    EXPECT_FALSE(proof.Holds(pair.plan)) << bad;
  }
}

PlannerConfig Literal(int degree, int steps, int skeletons, bool exact) {
  PlannerConfig c = PlannerConfig::Literal();
  c.degree = degree;
  c.steps = steps;
  c.skeletons = skeletons;
  c.exact_visibility = exact;
  return c;
}

Problem MakeInstance(const PlannerConfig& config, const InstanceSpec& spec, unsigned seed) {
  const PlanRequest request = InstanceGenerator(config, spec).Make(seed);
  Problem problem = MakeProblem(config, request, nullptr);
  SkeletonPlacer(config).Place(Layout::kNormal, &problem);
  return problem;
}

/// The obstacle that comes nearest to breaking safety or sight, by sampling.
const Ellipsoid& Tightest(const Problem& problem, const Curve& plan) {
  size_t tightest = 0;
  double least = HUGE_VAL;
  for (size_t j = 0; j < problem.obstacles.size(); ++j)
    for (int i = 0; i <= 100; ++i) {
      const double tau = i / 100.0;
      const double d = world::SegmentSquaredDistance(
          Evaluate(plan, tau), Evaluate(problem.target, tau),
          Evaluate(problem.obstacles[j].center, tau), problem.obstacles[j].sight);
      if (d < least) least = d, tightest = j;
    }
  return problem.obstacles[tightest];
}

// 2,000 whole plans: same winner as testing every candidate, refined, then 400 instants of the plan
// by definition, and the tightest obstacle in exact arithmetic.
TEST(WholePlans, AreSoundAndTheBest) {
  int plans = 0;
  for (unsigned seed = 0; plans < 2000; ++seed) {
    const bool hard = seed % 4 == 3, exact = seed % 2 == 0;
    const PlannerConfig config = Literal(seed % 5 == 4 ? 6 : 5, 3, 5, exact);
    InstanceSpec spec;
    spec.n_obstacles = 12;
    if (hard) spec.feasible_low = 0.0, spec.feasible_high = 0.06, spec.extent = 1.0;
    Problem problem = MakeInstance(config, spec, 5000 + seed);
    if (seed % 3 != 0) {
      const CandidateTables tables(config, config.degree, config.steps, problem.duration);
      LimitToReach(config, tables, Refiner::kReach, &problem);
    }
    const Found fast = MakeFastSearch(config)->Best(problem, 0.0, config.exact_visibility);
    const Found all = MakeReferenceSearch(config, Arithmetic::kCertified)
                          ->Best(problem, 0.0, config.exact_visibility);
    ASSERT_EQ(fast.index, all.index) << "seed " << seed;
    if (fast.index < 0) continue;
    ++plans;
    Curve plan = fast.plan;
    Cost cost = fast.cost;
    Refiner refiner(config);
    ASSERT_TRUE(refiner.Reset(problem, 0.0));
    refiner.Improve(4, &plan, &cost);
    ASSERT_LE(cost.total, fast.cost.total * (1.0 + 1e-12));
    ASSERT_NEAR(cost.total, Evaluate(config, problem, plan).total, 1e-9 * cost.total);
    ASSERT_EQ(SampleFaults(fast.plan, problem, 0.0, 400), "") << "seed " << seed;
    ASSERT_EQ(SampleFaults(plan, problem, 0.0, 400), "") << "seed " << seed;
    const Curve& checked = seed % 3 == 0 ? fast.plan : plan;
    const Ellipsoid& e = Tightest(problem, checked);
    ASSERT_TRUE(IsSafe(checked, e, Arithmetic::kExactSturm)) << "seed " << seed;
    ASSERT_TRUE(IsInSight(checked, problem.target, e, 0.0, exact, Arithmetic::kExactSturm))
        << "seed " << seed;
  }
}

// Winner, plan, cost and how many were tested: one candidate cleared or condemned otherwise shows
// in the counts.
TEST(Kernels, AllGiveTheSameBits) {
  std::vector<const kernels::Table*> tables = {&kernels::PortableKernels()};
  if (kernels::Avx2Kernels()) tables.push_back(kernels::Avx2Kernels());
  if (kernels::Avx512Kernels()) tables.push_back(kernels::Avx512Kernels());
  if (tables.size() < 2) GTEST_SKIP() << "this processor has neither AVX2 nor AVX-512";
  for (unsigned seed = 0; seed < 60; ++seed) {
    const PlannerConfig config =
        Literal(seed % 3 == 2 ? 6 : 5, 3, 3 + static_cast<int>(seed % 7), seed % 2 == 0);
    InstanceSpec spec;
    spec.n_obstacles = 5 + static_cast<int>(seed % 30);
    if (seed % 4 == 3) spec.feasible_low = 0.0, spec.feasible_high = 0.06, spec.extent = 2.0;
    const Problem problem = MakeInstance(config, spec, 9000 + seed);
    const Found first =
        MakeFastSearch(config, *tables[0])->Best(problem, 0.0, config.exact_visibility, *tables[0]);
    for (size_t i = 1; i < tables.size(); ++i) {
      const Found other = MakeFastSearch(config, *tables[i])
                              ->Best(problem, 0.0, config.exact_visibility, *tables[i]);
      ASSERT_EQ(first.index, other.index) << tables[i]->name << " seed " << seed;
      ASSERT_EQ(first.cost.total, other.cost.total) << tables[i]->name;
      ASSERT_EQ(first.checked, other.checked) << tables[i]->name << " seed " << seed;
      ASSERT_EQ(first.feasible, other.feasible) << tables[i]->name;
      if (first.index >= 0) {
        ASSERT_EQ(first.plan, other.plan) << tables[i]->name;
      }
    }
  }
}

TEST(FastSearch, OrderOfObstaclesAndEarlierProblemsDoNotMatter) {
  const PlannerConfig config = Literal(5, 3, 6, true);
  InstanceSpec spec;
  spec.n_obstacles = 20;
  const auto used = MakeFastSearch(config);
  Random g(7);
  for (unsigned seed = 0; seed < 100; ++seed) {
    Problem problem = MakeInstance(config, spec, 11000 + seed);
    const Found fresh = MakeFastSearch(config)->Best(problem, 0.0, config.exact_visibility);
    std::shuffle(problem.obstacles.begin(), problem.obstacles.end(), g);
    const Found again = used->Best(problem, 0.0, config.exact_visibility);
    ASSERT_EQ(fresh.index, again.index) << seed;
    if (fresh.index >= 0) {
      ASSERT_EQ(fresh.plan, again.plan) << seed;
    }
  }
}

}  // namespace
}  // namespace chase::planning
