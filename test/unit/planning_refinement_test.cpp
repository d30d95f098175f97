// What leads plans around obstacles, against independent computations.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/world/obstacle.h"
#include "services/planning/certificate.h"
#include "services/planning/cost.h"
#include "services/planning/enlargement.h"
#include "services/planning/fast_kernels.h"
#include "services/planning/fast_search.h"
#include "services/planning/refinement.h"
#include "services/planning/skeletons.h"
#include "test/unit/planning_instances.h"

namespace chase::planning {
namespace {

double Uniform(std::mt19937_64* g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(*g);
}

Eigen::Matrix3d RandomShape(std::mt19937_64* g) {
  Eigen::Vector3d radii;
  for (int a = 0; a < 3; ++a) radii[a] = Uniform(g, 0.2, 3.0);
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(Uniform(g, -1, 1), Uniform(g, -1, 1), Uniform(g, -1, 1), Uniform(g, -1, 1))
          .normalized();
  const Eigen::Matrix3d Q = turn.toRotationMatrix();
  return Q * radii.array().square().inverse().matrix().asDiagonal() * Q.transpose();
}

Eigen::Vector3d OnSurface(std::mt19937_64* g, const Eigen::Matrix3d& R) {
  const Eigen::Vector3d d(Uniform(g, -1, 1), Uniform(g, -1, 1), Uniform(g, -1, 1));
  return d / std::sqrt(d.dot(R * d));
}

TEST(Enlargement, HoldsEveryBallAboutTheShapeAndItsBoxHoldsTheShape) {
  std::mt19937_64 g(3);
  Enlargements memory;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Matrix3d R = RandomShape(&g);
    const double room = Uniform(&g, 0.01, 0.5);
    const Enlarged& e = memory.Of(static_cast<size_t>(i % 3), R, room);
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d ball =
          Eigen::Vector3d(Uniform(&g, -1, 1), Uniform(&g, -1, 1), Uniform(&g, -1, 1)).normalized();
      const Eigen::Vector3d x = OnSurface(&g, R) + room * ball;
      EXPECT_LE(x.dot(e.shape * x), 1.0 + 1e-9);
      const Eigen::Vector3d y = OnSurface(&g, e.shape);
      EXPECT_TRUE((y.array().abs() <= e.half).all());
    }
    const Eigen::Array3d half = HalfSidesOf(R);
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(half[a], std::sqrt(R.inverse()(a, a)), 1e-3 * half[a]);
  }
}

TEST(Clearance, KernelsSeeWhatTheSegmentsDistanceSaysAllWithTheSameBits) {
  std::mt19937_64 g(5);
  constexpr int n = 16;
  for (int trial = 0; trial < 50; ++trial) {
    kernels::ClearanceInput in{};
    double R[6 * n] = {}, center[6 * n] = {};
    uint8_t sight[n] = {};
    Eigen::Matrix3d shapes[n];
    in.free = 2 + trial % 2;
    in.n = in.rows = n;
    in.R = R;
    in.center = center;
    in.sight = sight;
    for (int j = 0; j < n; ++j) {
      shapes[j] = RandomShape(&g);
      const int at[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
      for (int i = 0; i < 6; ++i) R[i * n + j] = shapes[j](at[i][0], at[i][1]);
      for (int i = 0; i < 6; ++i) center[i * n + j] = Uniform(&g, -4, 4);
      sight[j] = j % 3 != 0;
    }
    double x[9];
    for (double& value : x) value = Uniform(&g, -3, 3);
    for (int k = 0; k < kernels::kSamples; ++k) {
      in.tau[k] = (k + 1.0) / kernels::kSamples;
      for (int f = 0; f < in.free; ++f) in.phi[f][k] = Uniform(&g, 0, 1);
      for (int a = 0; a < 3; ++a) {
        in.at[a][k] = Uniform(&g, -3, 3);
        in.target[a][k] = Uniform(&g, -3, 3);
      }
    }
    double values[n * kernels::kSamples], least[n];
    kernels::PortableKernels().clearance(in, x, values, least);
    for (int j = 0; j < n; ++j) {
      double lowest = HUGE_VAL;
      for (int k = 0; k < kernels::kSamples; ++k) {
        Eigen::Vector3d p, q, c;
        for (int a = 0; a < 3; ++a) {
          p[a] = in.at[a][k];
          for (int f = 0; f < in.free; ++f) p[a] += in.phi[f][k] * x[3 * f + a];
          q[a] = sight[j] ? in.target[a][k] : p[a];
          c[a] = center[a * n + j] + in.tau[k] * center[(3 + a) * n + j];
        }
        const double expected = sight[j] ? world::SegmentSquaredDistance(p, q, c, shapes[j])
                                         : (p - c).dot(shapes[j] * (p - c));
        EXPECT_NEAR(values[j * kernels::kSamples + k], expected, 1e-8 * (1.0 + expected));
        lowest = std::min(lowest, values[j * kernels::kSamples + k]);
      }
      EXPECT_EQ(least[j], lowest);
    }
    for (const kernels::Table* table : {kernels::Avx2Kernels(), kernels::Avx512Kernels()}) {
      if (!table) continue;
      double others[n * kernels::kSamples], their_least[n];
      table->clearance(in, x, others, their_least);
      for (int i = 0; i < n * kernels::kSamples; ++i) EXPECT_EQ(others[i], values[i]);
      for (int j = 0; j < n; ++j) EXPECT_EQ(their_least[j], least[j]);
    }
  }
}

// Improved and repaired plans keep what they promise, by the exhaustive test in exact arithmetic.
TEST(Refiner, PlansAroundObstaclesAreCertifiedAndKeepTheirStart) {
  PlannerConfig config;
  config.degree = 6;
  config.steps = 3;
  config.skeletons = 6;
  config.weight_smooth = 1.0;
  InstanceSpec spec;
  spec.n_obstacles = 15;
  const InstanceGenerator generator(config, spec);
  Refiner refiner(config);
  int improved = 0, repaired = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Problem problem = MakeProblem(config, generator.Make(seed), nullptr);
    SkeletonPlacer(config).PlaceRing(config.steps, config.skeletons, &problem);
    const int index = static_cast<int>(seed * 7919u) % problem.n_candidates();
    const Curve first = KktCandidates(config, problem)(index);
    if (!refiner.Reset(problem, 0.0)) continue;
    for (const bool repair : {false, true}) {
      Curve plan = first;
      Cost cost;
      const bool moved = repair ? refiner.Repair(&plan, &cost) : refiner.Improve(2, &plan, &cost);
      if (!moved) {
        EXPECT_EQ(plan, first);
        continue;
      }
      ++(repair ? repaired : improved);
      EXPECT_EQ(Curve(plan.topRows<4>()), problem.start);
      EXPECT_TRUE(IsFeasible(plan, problem, 0.0, true, Arithmetic::kExactSturm)) << seed;
      EXPECT_NEAR(cost.total, Evaluate(config, problem, plan).total, 1e-6 * (1.0 + cost.total));
    }
  }
  EXPECT_GT(improved, 20);
  EXPECT_GT(repaired, 10);
}

// Prefixes that cannot stay below the bound are ruled out together: no candidate below it is lost.
TEST(Search, ABoundLosesNothingThatIsBelowIt) {
  int found_some = 0;
  for (const int steps : {1, 2, 3})
    for (const int skeletons : {1, 8, 17}) {
      PlannerConfig config;
      config.steps = steps;
      config.skeletons = skeletons;
      config.adaptive = false;
      InstanceSpec spec;
      spec.n_obstacles = 12;
      const InstanceGenerator generator(config, spec);
      for (const kernels::Table* table :
           {&kernels::PortableKernels(), kernels::Avx2Kernels(), kernels::Avx512Kernels()}) {
        if (!table) continue;
        const auto search = MakeFastSearch(config, *table);
        PlanProof proof(*table);
        for (unsigned seed = 1; seed <= 8; ++seed) {
          Problem problem = MakeProblem(config, generator.Make(seed), nullptr);
          SkeletonPlacer(config).Place(Layout::kNormal, &problem);
          const auto best = [&](double bound) {
            proof.Reset(problem, 0.0, config.exact_visibility);
            return search->Best(problem, 0.0, bound, &proof);
          };
          const Found free = best(HUGE_VAL);
          if (free.index < 0) continue;
          ++found_some;
          for (const double share : {1.001, 10.0}) {
            const Found bounded = best(share * free.cost.total);
            EXPECT_EQ(bounded.index, free.index);
            EXPECT_EQ(bounded.cost.total, free.cost.total);
            EXPECT_EQ(bounded.plan, free.plan);
          }
          EXPECT_EQ(best(1e-6 * free.cost.total).index, -1);
        }
      }
    }
  EXPECT_GT(found_some, 100);
}

PlanRequest WalkPastPillar(double pillar_y) {
  PlanRequest request;
  request.start.p = {-2.5, 0.0, 1.5};
  request.target.duration = request.horizon;
  request.target.coefficients = Eigen::MatrixXd::Zero(2, 3);
  request.target.coefficients.row(0) << 0.0, 0.0, 1.0;
  request.target.coefficients.row(1) << request.horizon, 0.0, 0.0;
  world::Obstacle pillar;
  pillar.id = 7;
  pillar.center = world::Trajectory::Constant({-2.5, pillar_y, 1.0}, 0.0, request.horizon);
  pillar.shape = Eigen::Vector3d(4.0, 4.0, 0.1).asDiagonal();
  request.obstacles = {pillar};
  return request;
}

void ExpectSame(const std::vector<Proof>& a, const std::vector<Proof>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].obstacle, b[i].obstacle);
    EXPECT_EQ(a[i].radius, b[i].radius);
    ASSERT_EQ(a[i].separations.size(), b[i].separations.size());
    for (size_t k = 0; k < a[i].separations.size(); ++k)
      EXPECT_EQ(a[i].separations[k].normal, b[i].separations[k].normal);
  }
}

// Shapes and bodies are kept from plan to plan, in search and in stops: of other obstacles, or of
// margins that gave way, nothing must stay.
TEST(Planner, AnswersDoNotDependOnWhatWasAskedBefore) {
  const PlannerConfig config;
  std::vector<PlanRequest> requests(5, WalkPastPillar(0.885));
  for (size_t i = 1; i < requests.size(); ++i) requests[i] = WalkPastPillar(1.5);
  requests[2].obstacles[0].shape = Eigen::Vector3d(2.0, 6.0, 0.1).asDiagonal();
  requests[3].obstacles[0].solid = world::Obstacle::Solid::kBox;
  requests[3].obstacles[0].half = {0.35, 0.35, 2.0};
  requests[4].obstacles.insert(requests[4].obstacles.begin(), WalkPastPillar(-2.0).obstacles[0]);
  requests[4].obstacles[0].id = 8;
  std::vector<PlanResult> fresh;
  for (const PlanRequest& request : requests)
    fresh.push_back(MakePlanner("chase", config)->Plan(request));
  EXPECT_NE(fresh[0].reason.find("starts within the margin of obstacle 7"), std::string::npos);
  EXPECT_EQ(fresh[1].reason, "");
  const auto planner = MakePlanner("chase", config);
  for (const size_t i : {0, 1, 1, 0, 0, 2, 1, 3, 2, 4, 3, 1, 4, 2}) {
    const PlanResult plan = planner->Plan(requests[i]);
    EXPECT_EQ(plan.trajectory.coefficients, fresh[i].trajectory.coefficients);
    EXPECT_EQ(plan.reason, fresh[i].reason);
    EXPECT_EQ(plan.yaw, fresh[i].yaw);
    ASSERT_TRUE(plan.stop && fresh[i].stop);
    EXPECT_EQ(plan.stop->coefficients, fresh[i].stop->coefficients);
    ExpectSame(plan.proofs, fresh[i].proofs);
    ExpectSame(plan.stop_proofs, fresh[i].stop_proofs);
  }
}

// The line of sight passes a pillar within its margin when the plan starts: the margin gives way
// there and is said to, the target stays in sight.
TEST(Planner, SightThatStartsWithinAMarginIsKept) {
  PlannerConfig config;
  config.sight_margin = 0.4;
  PlanRequest request = WalkPastPillar(0.0);
  request.obstacles[0].center =
      world::Trajectory::Constant({-1.2, 0.75, 1.0}, 0.0, request.horizon);
  const PlanResult plan = MakePlanner("chase", config)->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
  EXPECT_NE(plan.reason.find("sight starts within the margin of obstacle 7"), std::string::npos)
      << plan.reason;
}

}  // namespace
}  // namespace chase::planning
