#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "services/control/plan_follower.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;

/// Moves along x at `speed` from x0 and curves along y.
Plan Moving(double start, double duration, double x0, double speed) {
  Plan plan;
  plan.position = {start, duration, Eigen::MatrixXd::Zero(4, 3)};
  plan.position.coefficients(0, 0) = x0;
  plan.position.coefficients(1, 0) = speed * duration;
  plan.position.coefficients(2, 1) = 0.5 * duration * duration;
  plan.position.coefficients(3, 2) = 0.1 * duration * duration * duration;
  plan.yaw = Vector3d(0.3, 0.5 * duration, 0.2 * duration * duration);
  return plan;
}

/// The plan with a way to rest that leaves it at `at`: position and velocity go on, b3 = b4 = b5.
Plan WithStop(Plan plan, double at, double duration) {
  const world::State s = plan.position.At(at);
  Eigen::Matrix<double, 6, 3> b;  // in Bernstein form
  b.row(0) = s.p.transpose();
  b.row(1) = b.row(0) + 0.2 * duration * s.v.transpose();
  b.row(2) = 2.0 * b.row(1) - b.row(0) + 0.05 * duration * duration * s.a.transpose();
  b.row(3) = 3.0 * b.row(2) - 3.0 * b.row(1) + b.row(0) +
             duration * duration * duration / 60.0 * s.j.transpose();
  b.row(4) = b.row(5) = b.row(3);
  const double choose[6][6] = {{1},          {1, 1},          {1, 2, 1},
                               {1, 3, 3, 1}, {1, 4, 6, 4, 1}, {1, 5, 10, 10, 5, 1}};
  plan.stop = {at, duration, Eigen::MatrixXd::Zero(6, 3)};
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i <= k; ++i)
      plan.stop->coefficients.row(k) +=
          ((k - i) % 2 ? -1.0 : 1.0) * choose[5][k] * choose[k][i] * b.row(i);
  return plan;
}

TEST(PlanFollower, HasNothingBeforeTheFirstPlanStarts) {
  PlanFollower follower;
  EXPECT_FALSE(follower.At(0.0));
  follower.Add(Moving(1.0, 2.0, 0.0, 1.0));
  EXPECT_FALSE(follower.At(0.99));
  EXPECT_TRUE(follower.At(1.0));
}

TEST(PlanFollower, GivesPlanAsItIs) {
  const Plan plan = Moving(1.0, 2.0, 0.0, 1.0);
  for (double t = 1.0; t < 2.99; t += 0.1) {
    const Reference r = Sample(plan, t);
    EXPECT_EQ(r.state.p, plan.position.Position(t));
    EXPECT_EQ(r.state.j, plan.position.Derivative(3, t));
    EXPECT_NEAR(r.yaw, 0.3 + 0.5 * (t - 1.0) + 0.2 * (t - 1.0) * (t - 1.0), 1e-12);
    EXPECT_NEAR(r.yaw_rate, 0.5 + 0.4 * (t - 1.0), 1e-12);
  }
}

TEST(PlanFollower, SwitchesAtTheNewPlansStart) {
  PlanFollower follower;
  follower.Add(Moving(0.0, 2.0, 0.0, 1.0));
  follower.Advance(0.5);
  EXPECT_TRUE(follower.Add(Moving(1.0, 2.0, 100.0, 1.0)));
  EXPECT_LT(follower.At(0.999)->state.p.x(), 10.0);
  EXPECT_GT(follower.At(1.0)->state.p.x(), 90.0);
  follower.Advance(1.0);
  EXPECT_GT(follower.At(1.0)->state.p.x(), 90.0);
}

TEST(PlanFollower, ReferenceIsContinuousOverConsistentPlans) {
  const Plan whole = Moving(0.0, 4.0, 0.0, 2.0);
  PlanFollower follower;
  follower.Add(whole);
  for (int i = 0; i < 300; ++i) {
    const double t = 0.01 * i;
    follower.Advance(t);
    if (i % 4 == 0) {  // the same motion, over a later interval
      Plan next;
      next.position = whole.position.Reparametrised(t + 0.03, 2.5);
      const double s = t + 0.03;
      next.yaw = Vector3d(0.3 + 0.5 * s + 0.2 * s * s, 2.5 * (0.5 + 0.4 * s), 0.2 * 2.5 * 2.5);
      follower.Add(next);
    }
    const auto r = follower.At(t);
    EXPECT_LT((r->state.p - whole.position.Position(t)).norm(), 1e-9) << t;
    EXPECT_LT((r->state.a - whole.position.Acceleration(t)).norm(), 1e-9) << t;
    EXPECT_NEAR(r->yaw, 0.3 + 0.5 * t + 0.2 * t * t, 1e-9) << t;
  }
}

TEST(PlanFollower, NewPlanReplacesThoseWaitingThatStartNoEarlier) {
  PlanFollower follower;
  follower.Add(Moving(0.0, 9.0, 0.0, 1.0));
  follower.Advance(0.0);
  follower.Add(Moving(2.0, 9.0, 200.0, 1.0));
  follower.Add(Moving(1.0, 9.0, 100.0, 1.0));
  EXPECT_NEAR(follower.At(2.0)->state.p.x(), 101.0, 1e-9);
}

TEST(PlanFollower, RefusesLateAndUnusablePlans) {
  PlanFollower follower;
  follower.Add(Moving(1.0, 2.0, 0.0, 1.0));
  follower.Advance(1.0);
  EXPECT_FALSE(follower.Add(Moving(0.9, 2.0, 0.0, 1.0)));
  EXPECT_FALSE(follower.Add(Moving(1.5, 0.0, 0.0, 1.0)));
  EXPECT_FALSE(follower.Add(Moving(1.5, -1.0, 0.0, 1.0)));
  Plan plan = Moving(1.5, 2.0, 0.0, 1.0);
  plan.yaw.resize(0);
  EXPECT_FALSE(follower.Add(plan));
  plan = Moving(1.5, 2.0, std::numeric_limits<double>::quiet_NaN(), 1.0);
  EXPECT_FALSE(follower.Add(plan));
}

// The newest is among them.
TEST(PlanFollower, KeepsFewWaitingPlans) {
  PlanFollower follower;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(follower.Add(Moving(i, 2.0, 0.0, 1.0)));
  std::set<const Plan*> kept;
  for (int i = 0; i < 1000; ++i) kept.insert(follower.FlownAt(i + 0.5));
  EXPECT_LE(kept.size(), 16u);
  EXPECT_GE(kept.size(), 4u);
  EXPECT_EQ(follower.FlownAt(999.0)->position.start, 999.0);
  follower.Advance(5.0);
  EXPECT_EQ(follower.FlownAt(5.0)->position.start, 5.0);
}

// Against a list of all that came, of which each drops those before it that start no earlier.
TEST(PlanFollower, FliesTheLastThatHasStartedAndWasNotReplaced) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> ahead(-0.3, 1.0);
  int late = 0;
  for (int flight = 0; flight < 50; ++flight) {
    PlanFollower follower;
    std::vector<Plan> all;
    const Plan* flown = nullptr;
    for (double t = 0.0; t < 5.0; t += 0.1) {
      Plan plan = Moving(t + ahead(random), 2.0, 0.0, 1.0);
      plan.seq = static_cast<int32_t>(1000.0 * t);
      const bool in_time = !flown || plan.position.start >= flown->position.start;
      EXPECT_EQ(follower.Add(plan), in_time);
      late += !in_time;
      const std::optional<Plan> kept = flown ? std::optional<Plan>(*flown) : std::nullopt;
      if (in_time) {
        all.erase(std::remove_if(all.begin(), all.end(),
                                 [&](const Plan& other) {
                                   return other.position.start >= plan.position.start &&
                                          !(kept && other.seq == kept->seq);
                                 }),
                  all.end());
        all.push_back(plan);
      }
      flown = nullptr;
      for (const Plan& x : all)
        if (x.position.start <= t && (!flown || x.position.start >= flown->position.start))
          flown = &x;
      const bool first =
          flight % 2;  // it is asked before it is told that time has passed, or after
      if (!first) follower.Advance(t);
      const Plan* found = follower.FlownAt(t);
      ASSERT_EQ(found == nullptr, flown == nullptr) << t;
      EXPECT_TRUE(!found || found->seq == flown->seq) << t;
      EXPECT_EQ(follower.At(t).has_value(), flown != nullptr);
      if (first) follower.Advance(t);
      ASSERT_TRUE(!flown || follower.FlownAt(t)->seq == flown->seq) << t;
    }
    follower.Clear();
    EXPECT_FALSE(follower.FlownAt(100.0));
  }
  EXPECT_GT(late, 50);
}

TEST(PlanFollower, RefusesNumbersThatAreNone) {
  const double none[] = {std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity()};
  for (const double x : none) {
    std::vector<Plan> bad(7, WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0));
    EXPECT_TRUE(PlanFollower().Add(bad[0]));
    bad[0].position.start = x;
    bad[1].position.duration = x;
    bad[2].position.coefficients(1, 2) = x;
    bad[3].stop->start = x;
    bad[4].stop->duration = x;
    bad[5].stop->coefficients(1, 2) = x;
    bad[6].yaw[1] = x;
    for (const Plan& plan : bad) EXPECT_FALSE(PlanFollower().Add(plan)) << &plan - bad.data();
  }
}

TEST(PlanFollower, TakesPlansAndStopsHoweverShort) {
  PlanFollower follower;
  EXPECT_TRUE(follower.Add(WithStop(Moving(0.0, 0.01, 0.0, 1.0), 0.005, 0.01)));
  EXPECT_TRUE(follower.At(0.007));
}

TEST(PlanFollower, APlanIsLeftForItsStopOrEnds) {
  Plan plan = WithStop(Moving(1.0, 2.0, 0.0, 3.0), 1.4, 1.0);
  EXPECT_EQ(StopsAt(plan), 1.4);
  plan.stop.reset();
  EXPECT_EQ(StopsAt(plan), 3.0);
}

TEST(PlanFollower, FliesTheStopInItsOwnTimeAndHoldsItsEnd) {
  const Plan plan = WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0);
  EXPECT_EQ(Sample(plan, 0.39).state.p, plan.position.Position(0.39));
  for (double t = 0.4; t < 1.399; t += 0.05) {
    EXPECT_EQ(Sample(plan, t).state.p, plan.stop->Position(t)) << t;
    EXPECT_EQ(Sample(plan, t).state.a, plan.stop->Acceleration(t)) << t;
  }
  for (const double t : {1.41, 2.0, 1000.0}) {
    const Reference r = Sample(plan, t);
    EXPECT_LT((r.state.p - plan.stop->Position(1.4)).norm(), 1e-12) << t;
    EXPECT_LT(r.state.v.norm() + r.state.a.norm() + r.state.j.norm(), 1e-12) << t;
    EXPECT_EQ(r.yaw_rate, 0.0) << t;
    EXPECT_NEAR(r.yaw, Sample(plan, 1.4 - 1e-9).yaw, 1e-8) << t;
  }
}

TEST(PlanFollower, ReferenceIsSmoothWhereThePlanIsLeft) {
  const Plan plan = WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0);
  const double h = 1e-5;
  for (double t = 0.3037; t < 1.6; t += 0.0101) {
    const auto at = [&](double u) { return Sample(plan, u); };
    const Vector3d v = (at(t + h).state.p - at(t - h).state.p) / (2 * h);
    const Vector3d a = (at(t + h).state.v - at(t - h).state.v) / (2 * h);
    EXPECT_LT((at(t).state.v - v).norm(), 1e-5) << t;
    EXPECT_LT((at(t).state.a - a).norm(), 1e-3) << t;
    EXPECT_NEAR(at(t).yaw_rate, (at(t + h).yaw - at(t - h).yaw) / (2 * h), 1e-5) << t;
    EXPECT_LT((at(t + h).state.a - at(t - h).state.a).norm(), 0.01) << t;
    EXPECT_LT(std::abs(at(t + 0.0101).yaw - at(t).yaw), 0.0101) << "no faster than the plan turns";
  }
}

TEST(PlanFollower, ANewPlanEndsTheStop) {
  PlanFollower follower;
  follower.Add(WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0));
  follower.Advance(0.9);
  follower.Add(Moving(1.0, 2.0, 5.0, 0.0));
  EXPECT_LT(follower.At(0.999)->state.p.x(), 4.0);
  EXPECT_NEAR(follower.At(1.0)->state.p.x(), 5.0, 1e-9);
}

TEST(PlanFollower, HoldsTheEndOfAPlanThatEndsAtRest) {
  Plan plan = Moving(0.0, 2.0, 0.0, 0.0);
  plan.position.coefficients.setZero();
  plan.position.coefficients.col(0) = Eigen::Vector4d(0, 3, -3, 1);  // 1 - (1 - tau)^3
  EXPECT_EQ(Sample(plan, 1.9).state.p, plan.position.Position(1.9));
  EXPECT_EQ(Sample(plan, 2.5).state.p, plan.position.Position(2.0));
  EXPECT_EQ(Sample(plan, 2.5).state.v, Vector3d::Zero());
  EXPECT_EQ(Sample(plan, 2.5).yaw_rate, 0.0);
}

TEST(PlanFollower, RefusesAStopThatIsNone) {
  PlanFollower follower;
  Plan plan = WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0);
  plan.stop->duration = 0.0;
  EXPECT_FALSE(follower.Add(plan));
  plan = WithStop(Moving(0.0, 2.0, 0.0, 3.0), 0.4, 1.0);
  plan.stop->coefficients(2, 1) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(follower.Add(plan));
}

}  // namespace
}  // namespace chase::control
