#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/math/bernstein.h"
#include "services/planning/field_of_view.h"
#include "services/planning/limits.h"
#include "services/planning/planner_config.h"

// Limits are certified for all of a plan: against dense sampling, both ways.

namespace chase::planning {
namespace {

using Eigen::Vector3d;
using Random = std::mt19937;

constexpr int kPlans = 3000;
constexpr int kInstants = 400;

double Uniform(Random& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

Curve RandomCurve(Random& g, int rows, const Vector3d& from, double spread) {
  Curve c(rows, 3);
  for (int k = 0; k < rows; ++k)
    for (int a = 0; a < 3; ++a) c(k, a) = Uniform(g, -spread, spread);
  c.row(0) = from.transpose();
  return c;
}

/// A plan of a degree that has control points, or of a higher one, and a target.
Problem RandomProblem(Random& g, Curve* plan) {
  Problem problem;
  problem.duration = Uniform(g, 0.5, 3.0);
  const int rows = g() % 4 ? 3 + static_cast<int>(g() % 5) : 9;
  const Vector3d from(Uniform(g, -30, 30), Uniform(g, -30, 30), Uniform(g, 0.5, 3));
  *plan = RandomCurve(g, rows, from, Uniform(g, 0.1, 2.0));
  const Vector3d away(Uniform(g, -3, 3), Uniform(g, -3, 3), Uniform(g, -1, 1));
  problem.target = RandomCurve(g, 1 + static_cast<int>(g() % 6), from + away, 0.5);
  return problem;
}

struct Extremes {
  double speed = 0.0, acceleration = 0.0, low = HUGE_VAL, high = -HUGE_VAL, near = HUGE_VAL,
         slope = 0.0, far = 0.0;  // tangent of the elevation; from the start, plan view
};

Extremes Sampled(const Curve& plan, const Problem& problem) {
  Extremes e;
  const double T = problem.duration;
  for (int i = 0; i <= kInstants; ++i) {
    const double tau = static_cast<double>(i) / kInstants;
    const Vector3d p = Evaluate(plan, tau), r = Evaluate(problem.target, tau) - p;
    e.speed = std::max(e.speed, Evaluate(plan, tau, 1).norm() / T);
    e.acceleration = std::max(e.acceleration, Evaluate(plan, tau, 2).norm() / (T * T));
    e.far = std::max(e.far, (p - Evaluate(plan, 0.0)).head<2>().norm());
    e.low = std::min(e.low, p.z());
    e.high = std::max(e.high, p.z());
    e.near = std::min(e.near, r.norm());
    e.slope = std::max(e.slope, std::abs(r.z()) / r.head<2>().norm());
  }
  return e;
}

/// `room`: by how much less than the limit the sampled value is, as a share; one limit of seven.
double SetLimit(Random& g, const Curve& plan, const Extremes& e, Limits* limits) {
  const double room = Uniform(g, -0.2, 0.2), by = 1.0 / (1.0 - room);
  switch (g() % 7) {
    case 0:
      limits->speed = by * e.speed;
      break;
    case 1:
      limits->acceleration = by * e.acceleration;
      break;
    case 2:
      limits->min_distance = e.near / by;
      break;
    case 3:
      limits->tan_elevation = by * e.slope;
      break;
    case 4:
      limits->height = true;
      limits->z_min = e.low - room;
      limits->z_max = e.high + 1.0;
      break;
    case 5:
      limits->listed_about = plan.row(0).head<2>();
      limits->listed_within = by * e.far;
      break;
    default:
      limits->height = true;
      limits->z_min = e.low - 1.0;
      limits->z_max = e.high + room;
  }
  return room;
}

TEST(Limits, HoldWhereSamplesSaySoAndNowhereElse) {
  Random g(11);
  int kept = 0, broken = 0;
  for (int i = 0; i < kPlans; ++i) {
    Curve plan;
    Problem problem = RandomProblem(g, &plan);
    const Extremes e = Sampled(plan, problem);
    const double room = SetLimit(g, plan, e, &problem.limits);
    if (e.slope > 50.0 || e.near < 0.1) continue;
    const bool keeps = KeepsLimits(plan, problem);
    EXPECT_FALSE(keeps && room < 0.0) << i;
    EXPECT_FALSE(!keeps && room > 0.02) << i;
    ++(room < 0.0 ? broken : kept);
  }
  EXPECT_GT(kept, kPlans / 4);
  EXPECT_GT(broken, kPlans / 4);
}

/// Each limit that the plan may break alone, so far from what it does.
void SetLimits(const Extremes& e, const double (&room)[7], Limits* limits) {
  limits->speed = e.speed * (1.0 + room[0]) + 1e-6;
  limits->acceleration = e.acceleration * (1.0 + room[1]) + 1e-6;
  limits->min_distance = e.near / (1.0 + room[2]);
  limits->tan_elevation = e.slope * (1.0 + room[3]) + 1e-6;
  limits->height = true;
  limits->z_min = e.low - room[4];
  limits->z_max = e.high + room[5];
  limits->listed_within = e.far * (1.0 + room[6]) + 1e-6;
}

// All of them at once: one that is broken is enough, whatever the degree of plan and target.
TEST(Limits, AllHoldTogetherOrThePlanDoesNot) {
  Random g(14);
  int kept = 0, broken[7] = {};
  for (int i = 0; i < kPlans; ++i) {
    Curve plan;
    Problem problem = RandomProblem(g, &plan);
    if (i % 3 == 0) plan = Curve(plan.topRows(1 + static_cast<int>(g() % 3)));
    const Extremes e = Sampled(plan, problem);
    if (e.slope > 50.0 || e.near < 0.1) continue;
    double room[7];
    problem.limits.listed_about = plan.row(0).head<2>();
    for (double& x : room) x = Uniform(g, 0.03, 0.2);
    SetLimits(e, room, &problem.limits);
    EXPECT_TRUE(KeepsLimits(plan, problem)) << i;
    ++kept;
    for (int k = 0; k < 7; ++k) {
      double less[7];
      std::copy(room, room + 7, less);
      less[k] = -Uniform(g, 0.02, 0.2);
      if (k == 0 && e.speed < 1e-3) continue;
      if (k == 1 && e.acceleration < 1e-3) continue;
      if (k == 3 && e.slope < 1e-3) continue;
      if (k == 6 && e.far < 1e-3) continue;
      SetLimits(e, less, &problem.limits);
      EXPECT_FALSE(KeepsLimits(plan, problem)) << i << " " << k;
      ++broken[k];
    }
  }
  EXPECT_GT(kept, kPlans / 2);
  for (const int n : broken) EXPECT_GT(n, kPlans / 2);
}

// Far from the origin rounding grows: what is called kept is so all the same, and what has room for
// a millimetre is called so.
TEST(Limits, HoldFarFromTheOrigin) {
  Random g(15);
  int kept = 0, broken = 0;
  for (int i = 0; i < 1000; ++i) {
    Curve plan;
    Problem problem = RandomProblem(g, &plan);
    const Extremes e = Sampled(plan, problem);
    const Vector3d far(1e6 * Uniform(g, -1, 1), 1e6 * Uniform(g, -1, 1), 1e4 * Uniform(g, -1, 1));
    plan.row(0) += far.transpose();
    problem.target.row(0) += far.transpose();
    problem.limits.height = true;
    const auto about = [&] { return Uniform(g, -1, 1) * std::pow(10.0, Uniform(g, -6, -2)); };
    const double above = about(), below = about();
    problem.limits.z_min = e.low + far.z() - below;
    problem.limits.z_max = e.high + far.z() + above;
    const double room = std::min(above, below);
    const bool keeps = KeepsLimits(plan, problem);
    EXPECT_FALSE(keeps && room < -1e-7) << i;
    EXPECT_FALSE(!keeps && room > 1e-3) << i;
    ++(keeps ? kept : broken);
  }
  EXPECT_GT(kept, 100);
  EXPECT_GT(broken, 100);
}

// Where power coefficients cancel, rounding is as large as they are: a speed that is exceeded by
// less than that, at the end, is not called kept.
TEST(Limits, AreNotKeptByRounding) {
  Random g(16);
  for (int i = 0; i < 300; ++i) {
    Vector3d along(Uniform(g, -1, 1), Uniform(g, -1, 1), Uniform(g, -1, 1));
    along[i % 3] = 0.0;
    math::Polynomial speed(8);  // Bernstein
    for (int k = 0; k < 7; ++k) speed[k] = (k % 2 ? 1.0 : -1.0) * Uniform(g, 0.5, 0.9);
    speed[7] = 1.0;
    speed = math::BernsteinToPower(speed);
    Curve plan = Curve::Zero(9, 3);
    for (int k = 1; k < 9; ++k) plan.row(k) = speed[k - 1] / k * along.transpose();
    long double squared = 0.0L;
    for (int a = 0; a < 3; ++a) {
      long double v = 0.0L;
      for (int k = 1; k < 9; ++k) v += k * static_cast<long double>(plan(k, a));
      squared += v * v;
    }
    Problem problem;
    problem.limits.speed = static_cast<double>(std::sqrt(squared)) * (1.0 - 1e-14);
    EXPECT_FALSE(KeepsLimits(plan, problem)) << i;
    problem.limits.speed *= 1.0 + 1e-6;
    EXPECT_TRUE(KeepsLimits(plan, problem)) << i;
  }
}

TEST(Limits, NoneIsAskedThatIsNotSet) {
  Random g(12);
  for (int i = 0; i < 100; ++i) {
    Curve plan;
    const Problem problem = RandomProblem(g, &plan);
    EXPECT_TRUE(KeepsLimits(plan, problem)) << i;
  }
}

PlanRequest At(const world::State& start) {
  PlanRequest request;
  request.start = start;
  request.target = world::Trajectory::Constant({5.0, 0.0, 1.0}, 0.0, 2.5);
  return request;
}

// Hovering above the heads of people it comes down slowly, whatever it wants below; level with them
// it does as it likes.
TEST(Limits, ComesDownNoFasterThanItSeesWhatIsBelow) {
  const auto planner = MakePlanner("chase", PlannerConfig());
  world::State s;
  s.p = {2.5, 0.0, 3.2};
  PlanRequest request = At(s);
  double quickest = 0.0, level = 0.0;
  for (; request.t0 < 12.0 && level == 0.0; request.t0 += 0.1) {
    const PlanResult plan = planner->Plan(request);
    request.start = plan.trajectory.At(request.t0 + 0.1);
    request.running = plan.trajectory;
    if (request.start.p.z() < 1.9) level = request.t0;
    if (level == 0.0) quickest = std::max(quickest, -request.start.v.z());
    request.target.start = request.t0 + 0.1;
  }
  EXPECT_LT(quickest, 0.9);
  EXPECT_GT(level, 1.5);
}

// From any start: what is in force is the file's limit, or what the start has already, no more.
TEST(Limits, GiveWayToTheStartOnly) {
  const PlannerConfig c;
  Random g(13);
  for (int i = 0; i < 1000; ++i) {
    world::State s;
    for (Vector3d* x : {&s.p, &s.v, &s.a})
      *x = {Uniform(g, -4, 4), Uniform(g, -4, 4), Uniform(g, -4, 4)};
    if (i % 4 == 0)  // nearly over or under the target
      s.p = Vector3d(5.0, 0.0, 1.0) + Vector3d(Uniform(g, -0.4, 0.4), 0.0, Uniform(g, -3, 3));
    const Limits l = MakeProblem(c, At(s), nullptr).limits;
    const double v = s.v.norm(), a = s.a.norm();
    EXPECT_GE(l.speed, std::max(c.max_speed, v));
    EXPECT_LE(l.speed, std::max(c.max_speed, v + 1e-5 * (1.0 + v)));
    EXPECT_GE(l.acceleration, std::max(c.max_acceleration, a));
    EXPECT_LE(l.acceleration, std::max(c.max_acceleration, a + 1e-5 * (1.0 + a)));
    // Braking at half of the acceleration after 0.2 s, where all of it, at once, does not do.
    const auto reach = [&](double speed, double more) {
      const double then = speed + 0.2 * std::max(0.0, more);
      return then > 0.0 ? 0.2 * std::max(0.0, speed) + then * then / l.acceleration : 0.0;
    };
    const auto least = [&](double speed) {
      return std::max(0.0, speed) * speed / (2.0 * l.acceleration);
    };
    const auto given = [&](double limit, double height, double speed, double more) {
      return height + least(speed) <= limit ? limit : std::max(limit, height + reach(speed, more));
    };
    double low = -given(-c.z_min, -s.p.z(), -s.v.z(), -s.a.z());
    const double high = given(c.z_max, s.p.z(), s.v.z(), s.a.z());
    // Half a metre a second and one in five beside that, above people.
    const double unseen = s.p.z() - 0.15 - 0.2 * s.v.head<2>().norm() * At(s).horizon;
    if (unseen > std::max(1.7, low)) low = std::min(unseen, s.p.z() - reach(-s.v.z(), -s.a.z()));
    EXPECT_NEAR(l.z_min, low, 1e-5);
    EXPECT_NEAR(l.z_max, high, 1e-5);
    // By a little more, as a plan at its limit would be at the mercy of rounding.
    EXPECT_LT(l.z_min, s.p.z() - least(-s.v.z()));
    EXPECT_GT(l.z_max, s.p.z() + least(s.v.z()));
    EXPECT_TRUE(l.speed > v && l.acceleration > a);
    EXPECT_TRUE(l.height && l.view);
    const Vector3d r = Vector3d(5.0, 0.0, 1.0) - s.p;
    EXPECT_NEAR(l.min_distance, std::min(c.min_distance, r.norm()), 1e-5);
    EXPECT_LT(l.min_distance, r.norm());
    const double tangent = std::tan(c.max_elevation_deg * M_PI / 180.0);
    const double now = std::abs(r.z()) / r.head<2>().norm();
    if (now < 10.0) {
      EXPECT_GE(l.tan_elevation, std::max(tangent, now));
      EXPECT_LE(l.tan_elevation, std::max(tangent, now + 1e-5 * (1.0 + now)));
    } else {
      EXPECT_EQ(l.tan_elevation, 0.0);
    }
    // In the image from the start on, or soon.
    const double down = std::tan(c.view_down_deg * M_PI / 180.0);
    const double up = std::tan(c.view_up_deg * M_PI / 180.0);
    const double below = SeenBelow(r, s.v, s.a, c.drag);
    EXPECT_EQ(l.view_from == 0.0, below < down && below > -up);
    EXPECT_TRUE(l.view_from == 0.0 || l.view_from == 0.25);
  }
}

// What is not limited in the file is not limited, and braking then counts as 2 m/s^2.
TEST(Limits, NoneThatTheFileDoesNotSet) {
  PlannerConfig c;
  c.max_speed = c.max_acceleration = c.max_elevation_deg = c.min_distance = 0.0;
  c.view_down_deg = 0.0;
  world::State s;
  s.p = {0.0, 0.0, 0.5};
  s.v = {1.0, 2.0, -1.0};
  s.a = {3.0, 0.0, 0.0};
  const Limits l = MakeProblem(c, At(s), nullptr).limits;
  EXPECT_EQ(l.speed, 0.0);
  EXPECT_EQ(l.acceleration, 0.0);
  EXPECT_EQ(l.tan_elevation, 0.0);
  EXPECT_EQ(l.min_distance, 0.0);
  EXPECT_FALSE(l.view);
  EXPECT_NEAR(l.z_min, 0.5 - 0.2 - 1.0 / 4.0, 1e-5);
  c.z_max = c.z_min;
  EXPECT_FALSE(MakeProblem(c, At(s), nullptr).limits.height);
}

}  // namespace
}  // namespace chase::planning
