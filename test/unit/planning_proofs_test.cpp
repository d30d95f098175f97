#include <gtest/gtest.h>

#include "services/planning/separations.h"
#include "test/unit/planning_flight.h"
#include "test/unit/planning_minkowski.h"

// What is proved of a plan, and what is not.

namespace chase::planning {
namespace {

using namespace minkowski;

bool IsSame(const Proof& a, const Proof& b) {
  const auto is_same = [](const world::Separation& s, const world::Separation& r) {
    return s.from == r.from && s.to == r.to && s.normal == r.normal;
  };
  return a.obstacle == b.obstacle && a.of_sight == b.of_sight && a.from == b.from &&
         a.radius == b.radius && a.room == b.room && a.target_radius == b.target_radius &&
         std::equal(a.separations.begin(), a.separations.end(), b.separations.begin(),
                    b.separations.end(), is_same);
}

/// What was found out while the plan was tried, and while others were, makes the same proofs.
TEST(Minkowski, ProofsAreTheSameFromMemory) {
  const PlannerConfig c;
  const auto planner = MakePlanner("chase", c);
  int proven = 0, with_less = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const PlanRequest request = RandomRequest(c, seed);
    const PlanResult plan = planner->Plan(request);
    if (plan.trajectory.duration != request.horizon) continue;
    const Problem problem = MakeProblem(c, request, nullptr);
    const Curve curve = plan.trajectory.coefficients;
    Curve other = curve;
    other.row(1).x() += 0.1;
    for (const double sight_from : {0.0, 1.0}) {
      const auto proofs = ProveOff(curve, problem, sight_from);
      SeparationMemory memory;
      StaysOff(other, problem, sight_from, nullptr, &memory);
      const bool off = StaysOff(curve, problem, sight_from, nullptr, &memory);
      const auto again = ProveOff(curve, problem, sight_from, &memory);
      ASSERT_EQ(again.has_value(), proofs.has_value()) << seed;
      EXPECT_EQ(off, proofs.has_value()) << seed;
      PlanRequest later = request;  // the same curve, when what moves is elsewhere
      later.t0 += 1.0;
      const Problem then = MakeProblem(c, later, nullptr);
      EXPECT_EQ(StaysOff(curve, then, sight_from, nullptr, &memory),
                StaysOff(curve, then, sight_from));
      EXPECT_EQ(StaysOff(curve, problem, sight_from, nullptr, &memory), off) << "as before";
      if (!proofs) continue;
      EXPECT_TRUE(std::equal(again->begin(), again->end(), proofs->begin(), proofs->end(), IsSame));
      ++proven;
      for (const Ellipsoid& e : problem.obstacles) with_less += e.sight_share < 1.0;
    }
  }
  EXPECT_GT(proven, 50);
  EXPECT_GT(with_less, 20);
}

Curve RandomCurve(Random* random, const Vector3d& from, int rows, double spread) {
  Curve curve = Curve::Zero(rows, 3);
  curve.row(0) = from.transpose();
  for (int k = 1; k < rows; ++k)
    curve.row(k) = world::RandomVector(random, spread, spread, 0.3 * spread).transpose();
  return curve;
}

/// Least gap of what the problem asks of the plan about an obstacle.
double LeastAsked(const PlanRequest& request, const Problem& problem, const Curve& plan,
                  const Ellipsoid& e, const world::Obstacle& o, double sight_from) {
  const world::Trajectory way{request.t0, request.horizon, plan};
  double least =
      LeastGap(way, e.safety_radius, e.safety_from, nullptr, o, problem.sigmas, world::kOverdue);
  const double from = std::max(sight_from, e.sight_from);
  if (from >= 1.0) return least;
  const world::Ball target = SeenBall(problem, e.sight_share);
  return std::min(least, LeastGap(way, e.sight_share * problem.sight_radius, from, &target, o,
                                  problem.sigmas, world::kOverdue));
}

/// Of any degree, from any time on, of all obstacles or of those that are near: what is called off
/// is, and what is off by a little is called so. No proof claims more room than there is.
TEST(Minkowski, PlansStayOffWhereSamplesSaySo) {
  PlannerConfig c;
  constexpr double kBetween = 0.03;  // m: nearer between the samples
  int off = 0, on = 0, refused = 0, high = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    c.safety_margin = seed % 2 ? 0.03 : 0.6;  // beyond what is kept of the line of sight
    Random random(seed, 81);
    PlanRequest request = RandomRequest(c, seed);
    request.obstacles.resize(std::min<size_t>(request.obstacles.size(), 1 + seed % 3));
    const auto rows = [&](int most) { return 1 + static_cast<int>(random.Next() % 9) % most; };
    const int n = random.Next() % 4 ? rows(7) : 9;
    request.target.coefficients = RandomCurve(&random, request.target.Position(request.t0),
                                              random.Next() % 4 ? rows(7) : 9, 1.0);
    request.target.start = request.t0;
    request.target.duration = request.horizon;
    const Curve plan = RandomCurve(&random, request.start.p, n, 2.0);
    request.start.v =
        plan.rows() > 1 ? Vector3d(plan.row(1).transpose() / request.horizon) : Vector3d::Zero();
    if (seed % 5 == 0) {
      request.target_body = request.obstacles.back();
      request.target_body->id = kTargetId;
    }
    Problem problem = MakeProblem(c, request, nullptr);
    const double sight_from = 0.25 * static_cast<double>(random.Next() % 5);
    std::vector<std::pair<Ellipsoid, world::Obstacle>> all;
    for (size_t i = 0; i < problem.obstacles.size(); ++i)
      all.emplace_back(problem.obstacles[i], request.obstacles[i]);
    if (problem.target_body) all.emplace_back(*problem.target_body, *request.target_body);
    double least = HUGE_VAL, latest = 0.0;
    size_t asked = 0;
    for (const auto& [e, o] : all) {
      least = std::min(least, LeastAsked(request, problem, plan, e, o, sight_from));
      latest = std::max(latest, e.safety_from);
      asked += std::max(sight_from, e.sight_from) < 1.0 ? 2 : 1;
    }
    if (latest > 0.0) continue;  // leaves it as well: another test
    Refusal last{static_cast<int>(random.Next() % 3) - 1, -1.0};
    const int before = last.obstacle;
    const bool stays = StaysOff(plan, problem, sight_from, seed % 2 ? &last : nullptr);
    const auto proofs = ProveOff(plan, problem, sight_from);
    EXPECT_EQ(proofs.has_value(), stays) << seed;
    EXPECT_FALSE(stays && least < -kTolerance) << seed << " " << least;
    refused += !stays && least > kBetween;
    EXPECT_TRUE(!stays || last.obstacle == before);
    if (!stays && seed % 2 && last.obstacle != before) {
      const auto& [e, o] = all[static_cast<size_t>(last.obstacle)];
      EXPECT_LT(LeastAsked(request, problem, plan, e, o, sight_from), kBetween) << seed;
    }
    for (int j = 0; j < static_cast<int>(problem.obstacles.size()); ++j)
      for (const double tau : {0.0, 0.5, 1.0}) {
        Refusal asked_first{j, tau};
        EXPECT_EQ(StaysOff(plan, problem, sight_from, &asked_first), stays) << seed;
      }
    ++(stays ? off : on);
    high += stays && (n > 7 || problem.target.rows() > 7);
    if (!proofs) continue;
    EXPECT_EQ(proofs->size(), asked);
    const world::Trajectory way{request.t0, request.horizon, plan};
    for (const Proof& p : *proofs) {
      if (p.of_sight) continue;
      const world::Obstacle& o =
          (p.obstacle == kTargetId ? all.back() : all[static_cast<size_t>(p.obstacle)]).second;
      EXPECT_TRUE(p.radius >= c.hard_radius() && p.room >= 0.0);
      EXPECT_GE(LeastGap(way, p.radius + p.room, p.from, nullptr, o, c.sigmas, world::kOverdue),
                -kTolerance)
          << seed;
    }
    // Those that are far need not be asked about.
    problem.reach = Box{Eigen::Array3d::Constant(-1e3), Eigen::Array3d::Constant(1e3)};
    problem.near.clear();
    if (n <= 7) {
      EXPECT_TRUE(StaysOff(plan, problem, sight_from));
      for (size_t i = 0; i < problem.obstacles.size(); ++i)
        problem.near.push_back(static_cast<int>(i));
      EXPECT_EQ(StaysOff(plan, problem, sight_from), stays);
    }
  }
  std::printf("%d stay off, %d do not, %d for want of a proof; %d of a high degree\n", off, on,
              refused, high);
  EXPECT_GT(off, 50);
  EXPECT_GT(on, 15);
  EXPECT_GT(high, 10);
  EXPECT_LE(refused, off / 20);
}

/// What the highest power alone leads a plan into, or a target behind, is near.
TEST(Minkowski, HighPowersAreNotLeftOut) {
  const PlannerConfig c;
  PlanRequest request;
  request.start.p = {0.0, 0.0, 1.5};
  request.target = world::Trajectory::Constant({0.0, 2.5, 1.5}, 0.0, request.horizon);
  request.obstacles = {test::Pillar(0, 5.0, 1.25)};
  Curve still = Curve::Zero(9, 3), away = Curve::Zero(9, 3);
  still.row(0) = request.start.p.transpose();
  away.row(0) = request.start.p.transpose();
  away.row(8) << 5.0, 1.25, 0.0;
  EXPECT_TRUE(StaysOff(still, MakeProblem(c, request, nullptr), 0.0));
  EXPECT_FALSE(StaysOff(away, MakeProblem(c, request, nullptr), 1.0));
  request.target.coefficients = Eigen::MatrixXd::Zero(9, 3);
  request.target.coefficients.row(0) << 0.0, 2.5, 1.5;
  request.target.coefficients.row(8) << 10.0, 0.0, 0.0;
  EXPECT_FALSE(StaysOff(still, MakeProblem(c, request, nullptr), 0.0));
}

}  // namespace
}  // namespace chase::planning
