#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/planning_pilot_flight.h"

namespace chase::planning {
namespace {

TEST(Pilot, ClimbsAndHoversWithoutATarget) {
  Flight flight{PlanningConfig()};
  flight.Run(6.0, false);
  EXPECT_EQ(flight.plans.front().verdict, Verdict::kWait);
  EXPECT_EQ(flight.plans.back().verdict, Verdict::kWait);
  EXPECT_NEAR(flight.Body().p.z(), 0.1 + PlanningConfig().takeoff_height, 1e-6);
  EXPECT_LT(flight.largest_kink, 1e-6);
}

TEST(Pilot, ChasesFollowsAndHoversWhenTheTargetIsLost) {
  Flight flight{PlanningConfig()};
  world::Obstacle pillar;
  pillar.id = 7;
  pillar.center = world::Trajectory::Constant({14.0, 3.0, 1.5}, 0.0, 100.0);
  pillar.shape = Eigen::Vector3d(0.3, 0.3, 2.0).cwiseAbs2().cwiseInverse().asDiagonal();
  flight.obstacles = {pillar};
  flight.Run(4.0, false);
  flight.Run(8.0, true);
  EXPECT_EQ(flight.plans.back().verdict, Verdict::kChase) << flight.plans.back().reason;
  const Eigen::Vector3d r = Walking(flight.t).target.Position(flight.t) - flight.Body().p;
  EXPECT_GT(r.norm(), 1.5);
  EXPECT_LT(r.norm(), 3.6);
  const size_t lost = flight.plans.size();
  double least = flight.Body().yaw, most = least;
  for (int i = 0; i < 240; ++i) {
    flight.Run(0.1, false);
    least = std::min(least, flight.Body().yaw), most = std::max(most, flight.Body().yaw);
    EXPECT_LT((flight.Body().p - r).head<2>().norm(), 20.0) << "within the target's reach";
  }
  EXPECT_GT(most - least, M_PI) << "looks around";
  bool went = false;
  for (size_t i = lost; i < flight.plans.size(); ++i) {
    const PlanResult& plan = flight.plans[i];
    if (plan.reason.find("target lost") != 0) continue;
    if (plan.reason.find("target lost, to where it may be") != 0) {
      EXPECT_GE(plan.verdict, Verdict::kBrake);
      continue;
    }
    went = true;
    EXPECT_EQ(plan.verdict, Verdict::kSafeOnly);
    EXPECT_GE(plan.certified_clearance, 0.0);
    for (const Proof& proof : plan.proofs)
      EXPECT_FALSE(proof.of_sight) << "of a place, which control would take for the target's";
  }
  EXPECT_TRUE(went) << "to where the target may have gone";
  EXPECT_LT(flight.largest_kink, 1e-6) << "plans continue where the one before is left";
  EXPECT_LT(flight.largest_step, 0.05);
}

/// What is planned at the origin, looking along `yaw`, once a target at that bearing is lost, which
/// stood when it was seen last, and moved at `speed` before.
std::vector<PlanResult> AfterTheLastSight(double yaw, double bearing, double speed, double radius,
                                          bool silent = false) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  BodyEstimate body{{0.0, 0.0, 1.3}, Eigen::Vector3d::Zero(), yaw};
  std::vector<PlanResult> plans;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.1 * i;
    pilot.SetObstacles(t, {});
    if (i < 7) {
      Forecast f = Walking(t);
      f.radius = radius;
      f.target.coefficients.row(0) << 2.5 * std::cos(bearing), 2.5 * std::sin(bearing), 0.5;
      f.target.coefficients.row(1) << (i < 4 ? 2.5 * speed : 0.0), 0.0, 0.0;
      pilot.SetForecast(f);
    } else {
      body.p.y() = 0.5 * (i % 2);  // off each plan: the next one starts here
      if (!silent) pilot.SetForecast(Nobody(t));
    }
    const auto plan = pilot.Update(t, body);
    if (plan && plan->reason.find("target lost") == 0) plans.push_back(*plan);
  }
  return plans;
}

bool Goes(const PlanResult& plan) {
  return plan.reason.find("target lost, to where it may be") == 0;
}

/// How the first plan turns that looks for a target which drove past: coefficients of its yaw from
/// the first power on. While the target was out of sight forecasts of a turn came, or none.
std::vector<double> LooksFor(bool misled) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  const BodyEstimate body{{0.0, 0.0, 1.0}, Eigen::Vector3d::Zero(), 0.0};
  for (double t = 0.0; t < 5.0; t += 0.1) {
    const double blind = t - 2.05;
    pilot.SetObstacles(t, {});
    Forecast f = Walking(t);
    f.target.coefficients.row(0) << 5.0 - 2.0 * t, 0.8, 0.5;
    f.target.coefficients.row(1) << -2.0 * 2.5, 0.0, 0.0;
    f.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    if (blind > 0.0) {
      f.covariance *= 400.0;
      f.target.coefficients.row(0) << 1.0 + blind, 0.8 + 1.2 * blind, 0.5;
      f.target.coefficients.row(1) << 2.5, 3.0, 0.0;
    }
    if (blind < (misled ? 1.4 : 0.0)) pilot.SetForecast(f);
    if (blind > 1.4) pilot.SetForecast(Nobody(t));
    const auto plan = pilot.Update(t, body);
    if (plan && t > 3.6 && plan->reason.find("target lost") == 0)
      return {plan->yaw.begin() + 1, plan->yaw.end()};
  }
  return {};
}

TEST(Pilot, LooksFromWhereTheTargetWasSeenLastNotFromWhereItWasForecast) {
  const std::vector<double> turn = LooksFor(true);
  EXPECT_FALSE(turn.empty());
  EXPECT_EQ(turn, LooksFor(false));
}

TEST(Pilot, SearchesFartherForWhoWasFast) {
  const auto goes = [](double speed) {
    const auto plans = AfterTheLastSight(0.0, 0.0, speed, 0.3);
    return std::count_if(plans.begin(), plans.end(), Goes);
  };
  EXPECT_GT(goes(3.0), goes(0.0));
}

// The target may be in sight all the time, and then it is no obstacle that is listed.
TEST(Pilot, GoesNowhereWhilePredictionIsSilent) {
  const auto plans = AfterTheLastSight(0.0, 0.0, 3.0, 0.0, true);
  EXPECT_GT(plans.size(), 10u);
  EXPECT_EQ(std::count_if(plans.begin(), plans.end(), Goes), 0);
}

// It does not flee from a curve that goes on where no forecast does.
TEST(Pilot, WhatItDoesWhilePredictionIsSilentIsCertified) {
  for (const auto task : {std::optional<Task>(), std::optional(Task::kHold),
                          std::optional(Task::kReturn), std::optional(Task::kLand)}) {
    Flight flight{PlanningConfig()};
    flight.curves = true;
    flight.Run(8.0, true);
    flight.predicts = false;
    flight.Run(1.5, true);
    if (task) flight.pilot.SetTask(*task, Eigen::Vector3d(0.0, 0.0, 0.1));
    flight.Run(2.0, true);
    const size_t before = flight.plans.size();
    const Eigen::Vector3d place = flight.Body().p;
    flight.Run(6.0, true);
    ASSERT_GT(flight.plans.size(), before);
    for (size_t i = before; i < flight.plans.size(); ++i)
      EXPECT_GE(flight.plans[i].certified_clearance, 0.0) << flight.plans[i].reason;
    if (task != Task::kReturn) {
      EXPECT_LT((flight.Body().p - place).norm(), 0.1);
    }
  }
}

// Who was last seen to come stays, for all that is planned, where its forecast ended.
TEST(Pilot, FleesFromNobodyWhoseForecastIsLongOver) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  pilot.SetTask(Task::kHold, Eigen::Vector3d::Zero());
  Forecast f = Walking(0.0);
  f.target.coefficients << 6.0, 0.0, 0.5, -2.5, 0.0, 0.0;  // over the drone in 6 s
  pilot.SetForecast(f);
  const BodyEstimate body{{0.0, 0.0, 1.3}, Eigen::Vector3d::Zero(), 0.0};
  for (double t = 0.0; t < 9.0; t += 0.1) {
    pilot.SetObstacles(t, {});
    const auto plan = pilot.Update(t, body);
    if (!plan || t < 2.0) continue;
    EXPECT_GE(plan->certified_clearance, 0.0) << t << ": " << plan->reason;
    const world::Trajectory& way = plan->trajectory;
    EXPECT_LT((way.Position(way.end()) - body.p).norm(), 0.01) << t << ": " << plan->reason;
  }
}

TEST(Pilot, TurnsToALostTargetTheShorterWay) {
  for (const auto& [yaw, bearing] : {std::pair(3.0, -3.0), {2.0, -2.5}})
    for (const double side : {1.0, -1.0}) {
      const auto plans = AfterTheLastSight(side * yaw, side * bearing, 0.0, 0.3);
      ASSERT_FALSE(plans.empty());
      EXPECT_GT(side * YawAt(plans[0].yaw, 0.0, plans[0].trajectory.duration).rate, 0.0) << bearing;
    }
}

// Places that nobody has looked into, from x = 8.5 m on.
world::Obstacle Dark() {
  world::Obstacle dark;
  dark.id = 3;
  dark.solid = world::Obstacle::Solid::kBox;
  dark.center = world::Trajectory::Constant({9.0, 0.0, 2.0}, 0.0, 100.0);
  dark.half = {0.5, 30.0, 2.0};
  dark.shape = (std::sqrt(3.0) * dark.half).cwiseAbs2().cwiseInverse().asDiagonal();
  return dark;
}

TEST(Pilot, FollowsNobodyToWhereNobodyHasLooked) {
  for (const bool looked : {true, false}) {
    Flight flight{PlanningConfig()};
    if (!looked) flight.unseen = {Dark()};
    flight.Run(3.0, false);
    flight.Run(12.0, true);
    EXPECT_EQ(flight.Body().p.x() > 8.5 - PlanningConfig().planner.hard_radius(), looked);
  }
}

// Near what nobody has looked into it brakes at once, too, when mapping falls silent.
TEST(Pilot, BrakesBesideTheUnseenWithoutLists) {
  int braked = 0;
  for (double silent = 11.5; silent < 13.5; silent += 0.1) {
    Flight flight{PlanningConfig()};
    flight.unseen = {Dark()};
    flight.Run(3.0, false);
    flight.Run(silent - 3.0, true);
    flight.hears = false;
    const size_t before = flight.plans.size();
    flight.Run(1.0, true);
    for (size_t i = before; i < flight.plans.size(); ++i) {
      const std::string& reason = flight.plans[i].reason;
      if (reason.find("not heard of") == std::string::npos) continue;
      ++braked;
      EXPECT_EQ(reason.find("until its stop"), std::string::npos) << silent;
    }
  }
  EXPECT_GT(braked, 50);
}

// But for what it moves until the plan begins no part of one is farther than what was listed.
TEST(Pilot, LeadsToNowhereThatNoListReaches) {
  for (const double within : {2.0, 9.0}) {
    PlanningConfig config;
    config.listed_within = within;
    Flight flight(config);
    flight.Run(12.0, true);
    double farthest = 0.0;
    for (const PlanResult& plan : flight.plans)
      for (const double tau : {0.25, 0.5, 0.75, 1.0}) {
        const world::Trajectory& way = plan.trajectory;
        const Eigen::Vector3d d =
            way.Position(way.start + tau * way.duration) - way.Position(way.start);
        farthest = std::max(farthest, d.head<2>().norm());
      }
    EXPECT_EQ(farthest < 2.0 - config.planner.hard_radius(), within == 2.0) << farthest;
    EXPECT_GT(flight.Body().p.x(), 3.0) << "it chases";
  }
}

TEST(Pilot, NeverPlansFasterThanItsLeastPeriod) {
  PlanningConfig config;
  Flight flight(config);
  flight.Run(4.0, false);
  const size_t before = flight.plans.size();
  flight.Run(2.0, true);
  EXPECT_LE(flight.plans.size() - before, static_cast<size_t>(2.0 / config.min_period) + 2);
  EXPECT_GE(flight.plans.size() - before, static_cast<size_t>(2.0 / config.replan_period) - 2);
}

TEST(Pilot, LargeTrackingErrorRestartsFromTheEstimate) {
  Pilot pilot{PlanningConfig()};
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  pilot.SetFlying(false);
  pilot.SetObstacles(0.0, {});
  pilot.Update(0.0, {zero, zero, 0.0});
  for (double t = 0.005; t < 5.0; t += kPeriod) {
    if (std::fmod(t, 0.1) < kPeriod) pilot.SetObstacles(t, {});
    const world::Trajectory& plan = pilot.running().trajectory;
    const double now = plan.degree() ? std::min(t, plan.end()) : t;
    pilot.Update(t, {plan.Position(now), zero, 0.0});
  }
  const Eigen::Vector3d away = pilot.running().trajectory.Position(5.0) + Eigen::Vector3d(1, 0, 0);
  const auto plan = pilot.Update(6.0, {away, zero, 0.0});
  ASSERT_TRUE(plan);
  EXPECT_LT((plan->trajectory.Position(plan->trajectory.start) - away).norm(), 1e-9);
}

TEST(Pilot, ABodyOutsideTheTubeIsPlannedForAtOnceFromWhereItIs) {
  const PlanningConfig config;
  for (const double off : {0.9, 1.1}) {
    Flight flight(config);
    flight.Run(4.0, false);
    flight.Run(4.0, true);
    // As soon as a plan is flown, which nothing new replaces for `replan_period`.
    while (flight.pilot.running().trajectory.start > flight.t ||
           flight.pilot.running().trajectory.start < flight.t - kPeriod)
      flight.Run(kPeriod, true);
    BodyEstimate body = flight.Body();
    body.p.y() += off * config.planner.tracking_tube;
    const auto plan = flight.pilot.Update(flight.t + config.min_period, body);
    EXPECT_EQ(plan.has_value(), off > 1.0);
    if (!plan) continue;
    const Eigen::Vector3d ahead = body.p + config.latency * body.v;
    EXPECT_LT((plan->trajectory.Position(plan->trajectory.start) - ahead).norm(), 1e-9);
  }
}

// The planner hangs while control goes over to the stop: what it plans then begins on that.
TEST(Pilot, APlanAfterALongSilenceBeginsOnTheStopThatIsFlown) {
  Flight flight{PlanningConfig()};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  while (flight.waiting) flight.Run(kPeriod, true);
  ASSERT_TRUE(flight.flown->stop);
  const world::Trajectory stop = *flight.flown->stop;
  flight.t = stop.start + 0.5 * stop.duration;
  const BodyEstimate body = flight.Body();
  ASSERT_GT((flight.flown->trajectory.Position(flight.t) - body.p).norm(), 0.01);
  const auto plan = flight.pilot.Update(flight.t, body);
  ASSERT_TRUE(plan);
  const double start = plan->trajectory.start;
  EXPECT_LT((plan->trajectory.Position(start) - stop.Position(start)).norm(), 1e-6);
  EXPECT_LT((plan->trajectory.Velocity(start) - stop.Velocity(start)).norm(), 1e-6);
}

TEST(Pilot, ARestartedChaseBeginsAtTheEstimatesVelocityWithoutAcceleration) {
  Flight flight{PlanningConfig()};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  const BodyEstimate pushed{flight.Body().p + Eigen::Vector3d(0, 1, 0), flight.Body().v, 0.0};
  std::optional<PlanResult> plan;
  for (double t = flight.t; !plan && t < flight.t + 1.0; t += kPeriod)
    plan = flight.pilot.Update(t, pushed);
  ASSERT_TRUE(plan);
  const world::State start = plan->trajectory.At(plan->trajectory.start);
  EXPECT_LT((start.p - pushed.p - PlanningConfig().latency * pushed.v).norm(), 1e-6);
  EXPECT_LT((start.v - pushed.v).norm(), 1e-6);
  EXPECT_LT(start.a.norm(), 1e-6);
}

TEST(Pilot, WaitsBelowFiveCentimetresASecondAndBrakesAbove) {
  for (const double speed : {0.0, 0.04, 0.06, 0.2}) {
    Pilot pilot{PlanningConfig()};
    pilot.SetFlying(true);
    pilot.SetObstacles(0.0, {});
    const auto plan = pilot.Update(0.0, {{0.0, 0.0, 1.5}, {0.0, speed, 0.0}, 0.0});
    ASSERT_TRUE(plan) << speed;
    EXPECT_EQ(plan->verdict, speed < 0.05 ? Verdict::kWait : Verdict::kBrake) << speed;
  }
}

// Not asked for longer than the stop of its plan takes it is where that ends, at rest.
TEST(Pilot, AfterItsPlanIsOverItGoesOnFromTheEndOfItsStop) {
  const PlanningConfig config;
  Flight flight{config};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  const PlanResult before = flight.pilot.running();
  ASSERT_TRUE(before.stop);
  const world::Trajectory &plan = before.trajectory, &stop = *before.stop;
  const double t = std::max(stop.end(), plan.end()) + 0.5;
  const Eigen::Vector3d end = stop.Position(stop.end());
  const YawStart left = YawAt(before.yaw, (stop.start - plan.start) / plan.duration, plan.duration);
  const double yaw = left.yaw + 0.5 * stop.duration * left.rate;
  for (const double off : {0.0, 0.1, 0.15}) {
    Flight again{config};
    again.Run(4.0, false);
    again.Run(4.0, true);
    const BodyEstimate body{end + Eigen::Vector3d(0.0, off, 0.0), {0.0, 0.1, 0.0}, 0.3};
    again.pilot.SetObstacles(t, {});
    const auto next = again.pilot.Update(t, body);
    ASSERT_TRUE(next);
    const world::State s = next->trajectory.At(next->trajectory.start);
    const bool far = off > config.planner.tracking_tube;
    const Eigen::Vector3d ahead = body.p + config.latency * body.v;
    EXPECT_LT((s.p - (far ? ahead : end)).norm(), 1e-6) << off;
    EXPECT_LT((s.v - (far ? body.v : Eigen::Vector3d(0, 0, 0))).norm(), 1e-6) << off;
    EXPECT_LT(s.a.norm(), 1e-6) << off;
    EXPECT_NEAR(YawAt(next->yaw, 0.0, next->trajectory.duration).yaw, far ? 0.3 : yaw, 1e-6);
  }
}

// A target that was chased before the frame changed, and is not seen soon after it, is looked for
// all around; one that was never seen is waited for.
TEST(Pilot, LooksAroundForWhomItLostWithTheFrame) {
  const PlanningConfig config;
  for (const bool chased : {false, true}) {
    Pilot pilot(config);
    pilot.SetFlying(true);
    BodyEstimate body{{0.0, 0.0, 1.2}, Eigen::Vector3d::Zero(), 0.0};
    double turned = 0.0;
    for (double t = 0.0; t < 14.0; t += 0.05) {
      if (std::abs(t - 1.0) < 0.01) pilot.ChangeFrame(), turned = 0.0;
      pilot.SetObstacles(t, {});
      Forecast forecast;
      forecast.t = t;
      forecast.has_target = chased && t < 0.99;
      forecast.target = world::Trajectory::Constant({2.5, 0.0, 0.7}, t, 2.5);
      pilot.SetForecast(forecast);
      pilot.Update(t, body);
      const PlanResult& plan = pilot.running();
      const double tau =
          std::clamp((t - plan.trajectory.start) / plan.trajectory.duration, 0.0, 1.0);
      const double yaw = YawAt(plan.yaw, tau, plan.trajectory.duration).yaw;
      turned += yaw - body.yaw;
      body.yaw = yaw;
      if (t > 1.0 && t < (chased ? 5.0 : 11.0)) {
        EXPECT_NEAR(turned, 0.0, 1e-3) << t;
      }
    }
    if (chased) {
      EXPECT_GT(turned, 2.0 * M_PI);
    }
  }
}

}  // namespace
}  // namespace chase::planning
