#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/unit/planning_pilot_flight.h"

// What the pilot makes of obstacles, forecasts and frames, late and broken ones among them.

namespace chase::planning {
namespace {

TEST(Pilot, OutdatedUnseenPlacesCountAsOutdatedObstacles) {
  for (const bool heard : {false, true})
    for (const bool frame : {false, true}) {
      Flight flight{PlanningConfig()};
      flight.Run(4.0, false);
      if (heard) flight.pilot.SetUnseen(flight.t, {});
      if (frame) flight.pilot.ChangeFrame();
      flight.Run(frame ? 0.2 : 2.0, true);  // in another frame at once
      EXPECT_EQ(flight.plans.back().reason.find("obstacles are not heard of") == 0, heard) << frame;
    }
}

TEST(Pilot, SaysThatNobodyTellsWhatIsUnseen) {
  Flight flight{PlanningConfig()};
  flight.pilot.ExpectUnseen(0.0);
  flight.Run(4.0, true);
  EXPECT_GE(flight.plans.back().certified_clearance, 0.0);
  flight.pilot.ChangeFrame();
  flight.pilot.ExpectUnseen(flight.t);
  const size_t before = flight.plans.size();
  flight.Run(0.4, true);  // to be told anew
  ASSERT_GT(flight.plans.size(), before);
  for (size_t i = 0; i < flight.plans.size(); ++i) {
    const PlanResult& plan = flight.plans[i];
    EXPECT_NE(plan.reason.find("nobody tells what is unseen"), std::string::npos) << plan.reason;
    if (i >= before) {
      EXPECT_LT(plan.certified_clearance, 0.0);
    }
  }
  flight.pilot.SetUnseen(flight.t, {});
  flight.Run(0.2, true);
  EXPECT_EQ(flight.plans.back().reason.find("unseen"), std::string::npos);
}

TEST(Pilot, WithoutObstaclesItBrakesAndCertifiesNothing) {
  Flight flight{PlanningConfig()};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  ASSERT_EQ(flight.plans.back().verdict, Verdict::kChase);
  flight.hears = false;
  flight.Run(0.35, true);
  const size_t before = flight.plans.size();
  flight.Run(4.0, true);
  ASSERT_GT(flight.plans.size(), before + 10);
  for (size_t i = before; i < flight.plans.size(); ++i) {
    const PlanResult& plan = flight.plans[i];
    EXPECT_TRUE(plan.verdict == Verdict::kBrake || plan.verdict == Verdict::kWait);
    EXPECT_LT(plan.certified_clearance, 0.0);
    EXPECT_TRUE(plan.proofs.empty());
    EXPECT_NE(plan.reason.find("not heard"), std::string::npos) << plan.reason;
  }
  EXPECT_LT(flight.Body().v.norm(), 0.05);
}

TEST(Pilot, SightIsKeptOverTheForecastsWorstAxis) {
  const PlanningConfig config;
  constexpr double kWorst = 0.2;  // m
  for (int axis = 0; axis < 3; ++axis) {
    Flight flight{config};
    world::Obstacle pillar;
    pillar.solid = world::Obstacle::Solid::kCylinder;
    pillar.half = {0.2, 0.2, 3.0};
    pillar.shape = pillar.half.cwiseAbs2().cwiseInverse().asDiagonal();
    pillar.center = world::Trajectory::Constant({4.0, 2.0, 1.0}, 0.0, 1.0);
    flight.obstacles = {pillar};
    flight.Run(4.0, false);
    Forecast forecast = Walking(flight.t);
    forecast.covariance(axis, axis) = kWorst * kWorst;
    flight.pilot.SetForecast(forecast);
    const auto plan = flight.pilot.Update(flight.t, flight.Body());
    ASSERT_TRUE(plan);
    int of_sight = 0;
    for (const Proof& proof : plan->proofs) {
      if (!proof.of_sight) continue;
      ++of_sight;
      EXPECT_GT(proof.target_radius[0], config.planner.sigmas * kWorst) << axis;
    }
    EXPECT_GT(of_sight, 0);
  }
}

TEST(Pilot, AListOfObstaclesIsAnsweredAtOnce) {
  const PlanningConfig config;
  for (const bool comes : {true, false}) {
    Flight flight{config};
    flight.Run(4.0, false);
    flight.Run(4.0, true);
    ASSERT_EQ(flight.plans.back().verdict, Verdict::kChase);
    while (flight.plans.back().trajectory.start > flight.t) flight.Run(kPeriod, false);
    flight.Run(config.min_period, false);
    const world::Trajectory& plan = flight.pilot.running().trajectory;
    world::Obstacle pillar;
    pillar.solid = world::Obstacle::Solid::kCylinder;
    pillar.half = {0.2, 0.2, 3.0};
    pillar.shape = pillar.half.cwiseAbs2().cwiseInverse().asDiagonal();
    pillar.center = world::Trajectory::Constant(plan.Position(plan.end()), flight.t, 1.0);
    if (comes) flight.pilot.SetObstacles(flight.t, {pillar});
    const auto answer = flight.pilot.Update(flight.t, flight.Body());
    EXPECT_EQ(answer.has_value(), comes);
  }
}

TEST(Pilot, WithoutObstaclesItNeitherClimbsNorChases) {
  Flight flight{PlanningConfig()};
  flight.hears = false;
  flight.Run(6.0, true);
  EXPECT_TRUE(flight.plans.empty());
}

// What is not known of a walker grows until it is everywhere: nothing to flee from.
TEST(Pilot, WithoutObstaclesItBrakesAndFleesFromNobody) {
  Flight flight{PlanningConfig()};
  flight.Run(6.0, false);
  const Eigen::Vector3d at = flight.Body().p;
  world::Obstacle walker;
  walker.solid = world::Obstacle::Solid::kCylinder;
  walker.half = {0.25, 0.25, 0.9};
  walker.shape = (2.0 * walker.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  walker.moving = true;
  walker.velocity_covariance = 0.25 * Eigen::Matrix3d::Identity();
  walker.center = world::Trajectory::Constant(at + Eigen::Vector3d(4.0, 0.5, 0.0), flight.t, 1.0);
  flight.obstacles = {walker};
  flight.Run(0.3, false);
  flight.hears = false;
  flight.Run(6.0, false);
  EXPECT_LT((flight.Body().p - at).norm(), 1.5) << "braking, once the list is outdated; 5 m else";
  EXPECT_LT(flight.plans.back().certified_clearance, 0.0);
}

// The list is outdated, and what stands is less and less certain as the pose is: that is nothing to
// climb away from.
TEST(Pilot, OldObstaclesAreNotFledFrom) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  world::Obstacle wall;
  wall.solid = world::Obstacle::Solid::kBox;
  wall.half = {0.1, 3.0, 2.0};
  wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  wall.center = world::Trajectory::Constant({0.6, 0.0, 1.0}, 0.0, 100.0);
  BodyEstimate body{{0.0, 0.0, 1.0}, Eigen::Vector3d::Zero(), 0.0};
  for (double t = 0.0; t < 5.0; t += kPeriod) {
    if (t < 0.5) pilot.SetObstacles(t, {wall});
    if (t > 1.0) body.velocity_covariance = 0.5 * t * Eigen::Matrix3d::Identity();
    const auto plan = pilot.Update(t, body);
    if (!plan || t < 0.9) continue;
    EXPECT_LT((plan->trajectory.Position(plan->trajectory.end()) - body.p).norm(), 0.01)
        << t << " " << plan->reason;
  }
}

TEST(Pilot, NothingOfAnotherFrameIsPlannedWith) {
  Flight flight{PlanningConfig()};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  ASSERT_EQ(flight.plans.back().verdict, Verdict::kChase);
  flight.pilot.SetObstacles(flight.t, {world::Obstacle()});
  flight.pilot.ChangeFrame();
  EXPECT_EQ(flight.pilot.n_obstacles(), 0);
  const BodyEstimate body{flight.Body().p + Eigen::Vector3d(0.3, 0.3, 0.0), flight.Body().v, 0.0};
  const auto plan = flight.pilot.Update(flight.t, body);
  ASSERT_TRUE(plan) << "the running plan is void";
  EXPECT_GE(plan->verdict, Verdict::kBrake) << "there is no target in this frame yet";
  const Eigen::Vector3d ahead = PlanningConfig().latency * body.v;
  EXPECT_LT((plan->trajectory.Position(plan->trajectory.start) - body.p - ahead).norm(), 1e-9);
  EXPECT_LT(plan->certified_clearance, 0.0) << "no obstacles were listed in this frame yet";
}

// Control flies nothing else without a certificate.
TEST(Pilot, WithoutObstaclesEveryPlanIsALastResortWhoeverComes) {
  for (const double speed : {0.0, 0.8, 2.0}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    flight.Run(4.0, true);
    flight.hears = false;
    const size_t before = flight.plans.size();
    for (int i = 0; i < 8; ++i) {
      Forecast comes = Walking(flight.t);
      const Eigen::Vector3d at = flight.Body().p;
      comes.target.coefficients.row(0) << at.x() + 1.2 - 0.3 * speed * i, at.y(), 0.5;
      comes.target.coefficients.row(1) << -2.5 * speed, 0.0, 0.0;
      flight.pilot.SetForecast(comes);
      flight.Run(0.3, false);
    }
    int unheard = 0;
    for (size_t i = before; i < flight.plans.size(); ++i) {
      const PlanResult& plan = flight.plans[i];
      if (plan.certified_clearance >= 0.0) continue;
      unheard++;
      EXPECT_TRUE(plan.verdict == Verdict::kBrake || plan.verdict == Verdict::kWait ||
                  plan.verdict == Verdict::kMitigate)
          << Name(plan.verdict) << ": " << plan.reason;
      EXPECT_TRUE(plan.proofs.empty() && plan.stop_proofs.empty());
    }
    EXPECT_GT(unheard, 5);
  }
}

/// Walks along x at -1.5 m/s.
world::Obstacle Walker(double x, double y) {
  world::Obstacle walker;
  walker.moving = true;
  walker.solid = world::Obstacle::Solid::kCylinder;
  walker.half = {0.3, 0.3, 0.9};
  walker.shape = (2.0 * walker.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  walker.center = {0.0, 10.0, Eigen::MatrixXd::Zero(2, 3)};
  walker.center.coefficients << x, y, 0.9, -15.0, 0.0, 0.0;
  return walker;
}

TEST(Pilot, AClimbWaitsForWhoeverPasses) {
  Flight flight{PlanningConfig()};
  flight.obstacles = {Walker(2.0, 0.0)};
  flight.Run(1.4, false);
  EXPECT_TRUE(flight.plans.empty());
  flight.Run(6.0, false);
  EXPECT_GT(flight.Body().p.z(), 1.0);
}

// Of somebody who was not seen to come, and goes.
TEST(Pilot, AHoverWithinSomebodysReachIsAnEscape) {
  Flight flight{PlanningConfig()};
  flight.Run(6.0, false);
  ASSERT_EQ(flight.plans.back().verdict, Verdict::kWait);
  world::Obstacle walker = Walker(0.0, 0.0);
  walker.center = {flight.t, 10.0, Eigen::MatrixXd::Zero(2, 3)};
  walker.center.coefficients << 0.6, 0.0, 0.9, 15.0, 0.0, 0.0;
  flight.obstacles = {walker};
  const size_t before = flight.plans.size();
  flight.Run(0.15, false);
  ASSERT_GT(flight.plans.size(), before);
  for (size_t i = before; i < flight.plans.size(); ++i) {
    const PlanResult& plan = flight.plans[i];
    const bool inside = std::any_of(plan.proofs.begin(), plan.proofs.end(),
                                    [](const Proof& proof) { return proof.from > 0.0; });
    EXPECT_EQ(plan.verdict == Verdict::kEscape, inside) << Name(plan.verdict) << plan.reason;
  }
  EXPECT_EQ(flight.plans[before].verdict, Verdict::kEscape) << flight.plans[before].reason;
}

// The target is in no list. Where it stands two metres off, and is hardly known yet, the drone
// climbs.
TEST(Pilot, AClimbWaitsForTheTargetToPass) {
  const auto climbs = [](double y, double speed) {
    Flight flight{PlanningConfig()};
    flight.predicts = false;
    Forecast forecast = Walking(0.0);
    forecast.target = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
    forecast.target.coefficients << 2.0, y, 0.5, -2.5 * speed, 0.0, 0.0;
    forecast.velocity_covariance = 0.5 * Eigen::Matrix3d::Identity();
    flight.pilot.SetForecast(forecast);
    flight.Run(1.2, false);
    return !flight.plans.empty();
  };
  EXPECT_FALSE(climbs(0.0, 1.5));
  EXPECT_TRUE(climbs(3.0, 1.5));
  EXPECT_TRUE(climbs(0.0, 0.0));
}

TEST(Pilot, AClimbThatWasBrokenOffUnderAMissionGoesOn) {
  Flight flight{PlanningConfig()};
  flight.pilot.SetFlying(false);
  flight.pilot.SetTask(Task::kTakeoff, Eigen::Vector3d(0.0, 0.0, 0.1));
  flight.obstacles = {Walker(4.0, 0.0)};
  flight.Run(2.2, false);
  EXPECT_LT(flight.Body().p.z(), 1.0);
  flight.Run(8.0, false);
  EXPECT_NEAR(flight.Body().p.z(), 1.3, 0.05);
  EXPECT_EQ(flight.plans.back().reason, "climbed");
}

// Somebody walks under it, or nobody can be seen any more: the climb is not flown to its end.
TEST(Pilot, AClimbIsBrokenOffWhereSomebodyComes) {
  const auto top = [](double y, bool hears) {
    Flight flight{PlanningConfig()};
    flight.obstacles = {Walker(3.0, y)};
    flight.Run(1.0, false);
    flight.hears = hears;
    flight.Run(2.0, false);
    return flight.Body().p.z();
  };
  const double whole = top(4.0, true);
  EXPECT_GT(whole, 1.0);
  EXPECT_LT(top(0.0, true), 0.7 * whole);
  EXPECT_LT(top(4.0, false), 0.7 * whole);
}

TEST(Pilot, AClimbIsNotBegunAnewInAnotherFrame) {
  for (const bool led : {false, true}) {
    Flight flight{PlanningConfig()};
    flight.Run(1.5, false);
    ASSERT_EQ(flight.plans.back().reason, "climbing");
    flight.pilot.SetFlying(true);
    flight.pilot.ChangeFrame();
    if (led) {
      flight.pilot.SetTask(Task::kTakeoff, std::nullopt);
      flight.pilot.SetObstacles(flight.t, {});
    }
    const BodyEstimate body = flight.Body();
    const auto plan = flight.pilot.Update(flight.t, body);
    ASSERT_TRUE(plan);
    EXPECT_NE(plan->reason, "climbing");
    EXPECT_LT(plan->trajectory.Position(plan->trajectory.end()).z(), body.p.z() + 0.5);
  }
}

TEST(Pilot, WhenTimeJumpsBackItPlansAtOnceFromWhereTheBodyIs) {
  for (const double back : {0.4, 5.0}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    flight.Run(4.0, true);
    flight.pilot.SetFlying(true);
    const BodyEstimate body = flight.Body();
    const auto plan = flight.pilot.Update(flight.t - back, body);
    ASSERT_TRUE(plan) << back;
    EXPECT_GE(plan->verdict, Verdict::kBrake) << "what was heard is of another time";
    EXPECT_LT((plan->trajectory.Position(plan->trajectory.start) - body.p).norm(), 0.1);
  }
}

// Plans that begin long after they are made are none of another time.
TEST(Pilot, WithTheLongestLatencyItChases) {
  PlanningConfig config;
  config.latency = 0.5;
  Flight flight(config);
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  EXPECT_LT(flight.plans.back().verdict, Verdict::kBrake) << flight.plans.back().reason;
}

// With the LiDAR dead the estimate grows unsure of its place: fleeing from what was listed would
// lead into space that nobody observes.
TEST(Pilot, WithoutListsItStaysWhereItIs) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  world::Obstacle pillar;
  pillar.solid = world::Obstacle::Solid::kCylinder;
  pillar.half = {0.3, 0.3, 2.0};
  pillar.shape = (2.0 * pillar.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  pillar.center = world::Trajectory::Constant({0.8, 0.0, 1.0}, 0.0, 1.0);
  pilot.SetObstacles(0.0, {pillar});
  BodyEstimate body{{0.0, 0.0, 1.3}, Eigen::Vector3d::Zero(), 0.0};
  body.position_covariance.diagonal().setConstant(0.1 * 0.1);
  const auto plan = pilot.Update(1.0, body);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->verdict, Verdict::kWait) << plan->reason;
  EXPECT_LT((plan->trajectory.Position(plan->trajectory.end()) - body.p).norm(), 0.01);
}

// Stamped by a clock that was set forward: it would count for seconds after its sender died.
TEST(Pilot, AListOfTheFutureCountsAsUnheard) {
  for (const double ahead : {0.05, 1.0}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    flight.hears = false;
    flight.pilot.SetObstacles(flight.t + ahead, {});
    flight.Run(0.25, true);
    EXPECT_EQ(flight.plans.back().reason.find("obstacles are not heard of") == 0, ahead > 0.1)
        << flight.plans.back().reason;
  }
}

TEST(Pilot, NoPlanReachesBeyondTheForecast) {
  Flight flight{PlanningConfig()};
  flight.Run(4.0, false);
  for (const double seconds : {1.2, 1.6, 2.1}) {
    Forecast forecast = Walking(flight.t);
    forecast.target.coefficients.row(1) *= seconds / forecast.target.duration;
    forecast.target.duration = seconds;
    flight.pilot.SetForecast(forecast);
    const size_t before = flight.plans.size();
    flight.Run(0.1, false);
    ASSERT_GT(flight.plans.size(), before);
    EXPECT_LE(flight.plans[before].verdict, Verdict::kKept) << flight.plans[before].reason;
    EXPECT_LE(flight.plans[before].trajectory.end(), forecast.target.end() + 1e-9);
  }
}

// As far as the forecast is uncertain, plans keep off its body and sight allows for it.
TEST(Pilot, TheForecastsUncertaintyAndBodyReachThePlan) {
  for (const double sigma : {0.1, 0.3}) {
    PlanningConfig config;
    config.planner.min_distance = 0.0;
    config.planner.desired_distance = 0.5;
    Flight flight{config};
    flight.Run(4.0, false);
    world::Obstacle pillar;
    pillar.id = 4;
    pillar.solid = world::Obstacle::Solid::kCylinder;
    pillar.half = {0.2, 0.2, 3.0};
    pillar.shape = (2.0 * pillar.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    pillar.center = world::Trajectory::Constant({flight.t + 2.5, 4.0, 1.0}, flight.t, 1.0);
    flight.pilot.SetObstacles(flight.t, {pillar});
    Forecast forecast = Walking(flight.t);
    forecast.target.coefficients << 2.5, 0.0, 0.5, -2.5, 0.0, 0.0;
    const double speed_sigma = 0.5 * sigma;
    forecast.covariance = sigma * sigma * Eigen::Matrix3d::Identity();
    forecast.velocity_covariance = 0.25 * forecast.covariance;
    forecast.radius = 0.3;
    forecast.height = 2.0;
    flight.pilot.SetForecast(forecast);
    const auto plan = flight.pilot.Update(flight.t, flight.Body());
    ASSERT_TRUE(plan);
    ASSERT_GE(plan->certified_clearance, 0.0) << plan->reason;
    const PlannerConfig& c = config.planner;
    const auto distance = [&](const world::Trajectory& way, double t) {
      const Eigen::Vector3d d = way.Position(t) - forecast.target.Position(t);
      return std::hypot(std::max(0.0, d.head<2>().norm() - forecast.radius),
                        std::max(0.0, std::abs(d.z()) - 0.5 * forecast.height));
    };
    for (double t = plan->trajectory.start; t <= plan->trajectory.end(); t += 0.02) {
      const double since = t - forecast.t;
      const double deviations = c.sigmas * std::hypot(sigma, since * speed_sigma);
      EXPECT_GE(distance(plan->trajectory, t), c.hard_radius() + deviations - 1e-3) << since;
    }
    // Until the stop begins, and along it, the target manoeuvres, too: along the ground.
    const world::Manoeuvre manoeuvre{config.target_acceleration, config.target_memory};
    const auto deviation = [&](double since) {
      const double v = since * speed_sigma;
      return std::sqrt(sigma * sigma + v * v + manoeuvre.Variance(since));
    };
    ASSERT_TRUE(plan->stop);
    for (double t = plan->trajectory.start; t <= plan->stop->end(); t += 0.02) {
      const world::Trajectory& way = t < plan->stop->start ? plan->trajectory : *plan->stop;
      const Eigen::Vector3d d = way.Position(t) - forecast.target.Position(t);
      const double since = t - forecast.t, level = c.sigmas * deviation(since);
      const double up = c.sigmas * std::hypot(sigma, since * speed_sigma);
      for (double off = 0.0; off < 1.6; off += 0.1)
        EXPECT_GE(
            std::hypot(std::max(0.0, d.head<2>().norm() - forecast.radius - level * std::cos(off)),
                       std::max(0.0, std::abs(d.z()) - 0.5 * forecast.height - up * std::sin(off))),
            c.hard_radius() - 1e-3)
            << t << " " << off;
    }
    int sights = 0;
    for (const Proof& p : plan->proofs) {
      if (!p.of_sight) continue;
      ++sights;
      EXPECT_GE(p.target_radius[0], c.sight_margin + c.sigmas * sigma - 1e-9);
      EXPECT_GE(p.target_radius.sum(),
                c.sight_margin + c.sigmas * deviation(plan->trajectory.duration) - 1e-9);
    }
    EXPECT_EQ(sights, 1) << sigma;
  }
}

TEST(Pilot, ALowTargetHasABodyToo) {
  for (const double height : {0.0, 0.2, 2.0}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    Forecast forecast = Walking(flight.t);
    forecast.target.coefficients << 2.5, 0.0, 1.2, -2.5, 0.0, 0.0;  // at the drone, and as high
    forecast.height = height;
    flight.pilot.SetForecast(forecast);
    const auto plan = flight.pilot.Update(flight.t, flight.Body());
    ASSERT_TRUE(plan);
    const auto of_target = [](const Proof& p) { return p.obstacle == kTargetId && !p.of_sight; };
    EXPECT_EQ(std::any_of(plan->proofs.begin(), plan->proofs.end(), of_target), height > 0.0)
        << height << plan->reason;
  }
}

// A forecast that is nearly over is worth a second; one that is no number is worth nothing.
TEST(Pilot, ShortForecastsAreUsedAndBrokenOnesAreSurvived) {
  for (const bool broken : {false, true}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    flight.Run(2.0, true);
    Forecast forecast = Walking(flight.t);
    forecast.target = forecast.target.Reparametrised(flight.t, 0.6);
    if (broken) forecast.target.coefficients(1, 1) = std::nan("");
    flight.pilot.SetForecast(forecast);
    const size_t before = flight.plans.size();
    flight.Run(0.1, false);
    ASSERT_GT(flight.plans.size(), before);
    for (size_t i = before; i < flight.plans.size(); ++i) {
      const PlanResult& plan = flight.plans[i];
      EXPECT_TRUE(plan.trajectory.coefficients.allFinite());
      for (const double y : plan.yaw) EXPECT_TRUE(std::isfinite(y));
      EXPECT_EQ(plan.verdict >= Verdict::kBrake, broken) << plan.reason;
      EXPECT_TRUE(broken || std::abs(plan.trajectory.duration - 1.0) < 1e-9);
    }
  }
}

// What stands is braked for though the list is old; what moves is anywhere by then.
TEST(Pilot, WithoutObstaclesItStillKnowsWhatStands) {
  const auto farthest = [](bool moves) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    flight.Run(5.0, true);
    const BodyEstimate body = flight.Body();
    EXPECT_GT(body.v.norm(), 0.5);
    world::Obstacle wall;
    wall.moving = moves;
    wall.solid = world::Obstacle::Solid::kBox;
    wall.half = {0.1, 20.0, 20.0};
    wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    wall.center =
        world::Trajectory::Constant(body.p + Eigen::Vector3d(0.65, 0.0, 0.0), flight.t, 1.0);
    flight.pilot.SetObstacles(flight.t, {wall});
    const auto plan = flight.pilot.Update(flight.t + 0.31, body);
    EXPECT_TRUE(plan && plan->reason.find("not heard") != std::string::npos);
    double most = -HUGE_VAL;
    for (double t = plan->trajectory.start; t <= plan->trajectory.end(); t += 0.02)
      most = std::max(most, plan->trajectory.Position(t).x());
    return most;
  };
  EXPECT_LT(farthest(false), farthest(true) - 0.05);
}

TEST(PlanningConfig, DefaultsAreFineAndBadValuesAreNamed) {
  PlanningConfig config;
  EXPECT_EQ(config.Problem(), "");
  EXPECT_EQ(config.planner.Problem(), "");
  config.horizon = 0.0;
  EXPECT_NE(config.Problem().find("horizon"), std::string::npos);
  config.planner.skeletons = 100;
  EXPECT_NE(config.planner.Problem().find("skeletons"), std::string::npos);
}

}  // namespace
}  // namespace chase::planning
