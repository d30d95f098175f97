#include <gtest/gtest.h>

#include "services/planning/fast_search.h"
#include "services/planning/reference_search.h"
#include "services/planning/separations.h"
#include "services/planning/sturm_check.h"
#include "test/unit/planning_instances.h"

namespace chase::planning {
namespace {

struct Row {
  const char* name;
  PlannerConfig config;
  InstanceSpec spec;
  int n;
};

PlannerConfig Literal(int degree, int steps, int skeletons, bool exact) {
  PlannerConfig c = PlannerConfig::Literal();
  c.degree = degree;
  c.steps = steps;
  c.skeletons = skeletons;
  c.exact_visibility = exact;
  return c;
}

InstanceSpec Spec(double horizon, int n_obstacles, bool hard) {
  InstanceSpec s;
  s.horizon = horizon;
  s.n_obstacles = n_obstacles;
  if (hard) s.feasible_low = 0.0, s.feasible_high = 0.06, s.extent = 2.0;
  return s;
}

void ExpectSameWinner(const PlannerConfig& config, const InstanceSpec& spec, Arithmetic arithmetic,
                      unsigned seed, int n) {
  const InstanceGenerator generator(config, spec);
  const auto fast = MakeFastSearch(config), reference = MakeReferenceSearch(config, arithmetic);
  for (int i = 0; i < n; ++i) {
    const PlanRequest request = generator.Make(seed + static_cast<unsigned>(i));
    Problem problem = MakeProblem(config, request, nullptr);
    SkeletonPlacer(config).Place(Layout::kNormal, &problem);
    const Found a = fast->Best(problem, 0.0, config.exact_visibility),
                b = reference->Best(problem, 0.0, config.exact_visibility);
    ASSERT_EQ(a.index, b.index) << "seed " << seed + static_cast<unsigned>(i) << " cost "
                                << a.cost.total << " against " << b.cost.total;
    if (a.index < 0) continue;
    ASSERT_NEAR(a.cost.total, b.cost.total, 1e-8 * b.cost.total);
    ASSERT_NEAR(a.cost.j1, b.cost.j1, 1e-6 * (1 + b.cost.j1));
    ASSERT_NEAR(a.cost.j2, b.cost.j2, 1e-8);
    ASSERT_NEAR(a.cost.j4, b.cost.j4, 1e-6 * (1 + b.cost.j4));
    ASSERT_EQ(SampleFaults(a.plan, problem, 0.0, 300), "");
  }
}

TEST(FastSearch, FindsTheReferencesWinner) {
  ExpectSameWinner(Literal(5, 3, 8, false), Spec(5.0, 20, false), Arithmetic::kDoubleSturm, 100,
                   40);
  ExpectSameWinner(Literal(6, 3, 6, false), Spec(5.0, 20, false), Arithmetic::kDoubleSturm, 200,
                   40);
  ExpectSameWinner(Literal(5, 4, 5, false), Spec(2.5, 50, false), Arithmetic::kDoubleSturm, 300,
                   40);
  ExpectSameWinner(Literal(5, 3, 8, false), Spec(5.0, 50, true), Arithmetic::kDoubleSturm, 400, 40);
}

TEST(FastSearch, FindsTheCertifiedWinnerWithExactVisibility) {
  ExpectSameWinner(Literal(5, 3, 8, true), Spec(5.0, 20, false), Arithmetic::kCertified, 500, 15);
  ExpectSameWinner(Literal(5, 3, 6, true), Spec(5.0, 50, true), Arithmetic::kCertified, 600, 15);
  ExpectSameWinner(Literal(6, 3, 5, true), Spec(5.0, 50, true), Arithmetic::kCertified, 700, 15);
}

struct Tally {
  int found = 0, lost = 0, others = 0, refused = 0;
};

// Bodies whose places are uncertain, by both searches.
Tally SearchAmongBodies(const InstanceSpec& spec, unsigned seed, int n) {
  const PlannerConfig plain = Literal(5, 3, 6, true);
  PlannerConfig config = plain;
  config.minkowski_sums = true;
  config.sigmas = 2.0;
  const InstanceGenerator generator(plain, spec);
  const auto fast = MakeFastSearch(config),
             reference = MakeReferenceSearch(config, Arithmetic::kCertified);
  Tally tally;
  for (int i = 0; i < n; ++i) {
    PlanRequest request = generator.Make(seed + static_cast<unsigned>(i));
    for (world::Obstacle& o : request.obstacles)
      o.velocity_covariance.diagonal().setConstant(4e-3);  // m^2/s^2
    Problem problem = MakeProblem(config, request, nullptr);
    SkeletonPlacer(config).Place(Layout::kNormal, &problem);
    const Found a = fast->Best(problem, 0.0, true), b = reference->Best(problem, 0.0, true);
    EXPECT_TRUE(a.index < 0 || StaysOff(a.plan, problem, 0.0)) << "problem " << i;
    tally.found += b.index >= 0;
    tally.lost += b.index >= 0 && a.index < 0;
    tally.others += a.index != b.index;
    for (Ellipsoid& e : problem.obstacles) e.body.reset();
    tally.refused += a.index >= 0 && fast->Best(problem, 0.0, true).index != a.index;
  }
  return tally;
}

// The ellipsoids let candidates pass that come too near to the solid's sum with the balls. The
// search gives up after 64 of them.
TEST(FastSearch, FindsTheWinnerBeyondThoseThatTheProofRefuses) {
  const Tally tally = SearchAmongBodies(Spec(5.0, 50, false), 900, 200);
  EXPECT_GT(tally.refused, 10);
  EXPECT_LT(tally.others, 3);
}

// Candidates at the edges of the ellipsoids are left at first: not for good.
TEST(FastSearch, LosesNoneThatAreAtTheEdge) {
  const Tally tally = SearchAmongBodies(Spec(5.0, 50, true), 1200, 400);
  EXPECT_GT(tally.found, 10);
  EXPECT_EQ(tally.lost, 0);
}

// Shapes for safety and sight that differ (margins) and that do not, sight from the start, from
// later and never.
TEST(SturmCheck, AgreesWithTheCertificate) {
  for (const bool margins : {false, true}) {
    PlannerConfig config = Literal(6, 2, 5, false);
    if (margins) config.drone_radius = 0.1, config.sight_margin = 0.5;
    for (unsigned seed = 800; seed < 806; ++seed) {
      Problem problem =
          MakeProblem(config, InstanceGenerator(config, Spec(5.0, 20, true)).Make(seed), nullptr);
      SkeletonPlacer(config).Place(Layout::kNormal, &problem);
      const KktCandidates candidates(config, problem);
      for (const double from : {0.0, 0.5, 1.0})
        for (const Ellipsoid& e : problem.obstacles) {
          const SturmCheck check(problem.target, e, from, problem.degree + 1);
          for (int i = 0; i < problem.n_candidates(); ++i) {
            const Curve plan = candidates(i);
            const bool safe = IsSafe(plan, e, Arithmetic::kCertified),
                       seen =
                           IsInSight(plan, problem.target, e, from, false, Arithmetic::kCertified);
            ASSERT_EQ(check.IsSafe(plan), safe) << "seed " << seed << " obstacle " << e.id;
            ASSERT_EQ(check.IsInSight(plan), seen) << "seed " << seed << " obstacle " << e.id;
            ASSERT_EQ(check.IsClear(plan), safe && seen) << "seed " << seed << " obstacle " << e.id;
          }
        }
    }
  }
}

}  // namespace
}  // namespace chase::planning
