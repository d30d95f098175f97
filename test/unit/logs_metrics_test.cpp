#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "chase/flight_state_t.hpp"
#include "chase/plan_t.hpp"
#include "logs/src/estimate_errors.h"
#include "logs/src/landing_watch.h"
#include "logs/src/metrics.h"
#include "logs/src/read_flight.h"

namespace chase::logs {
namespace {

using Eigen::Vector3d;

/// One pillar at the origin; the chaser stands at p and the target at q for ten seconds.
FlightRecord Standing(const Vector3d& p, const Vector3d& q) {
  FlightRecord record;
  record.scenario.duration_s = 10.0;
  record.scenario.chaser.radius = 0.25;
  record.scenario.chaser.desired_distance = 2.5;
  record.scenario.world.cylinders.push_back({{0.0, 0.0}, 0.28, 3.0, 0.0});
  for (int k = -100; k <= 1100; ++k) {
    TruthSample s;
    s.t = k * 0.01;
    s.p = p;
    s.target = q;
    s.target_in_image = true;
    record.truth.push_back(s);
  }
  return record;
}

TEST(Metrics, OnlyTheMissionCounts) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  for (TruthSample& s : record.truth)
    if (s.t < -1e-9 || s.t > 10.0 + 1e-9) s.p = Vector3d::Zero();  // inside the pillar
  EXPECT_EQ(Score(record).size(), 1001u);
  EXPECT_EQ(*Compute(record).safe_ratio, 1.0);
}

TEST(Metrics, ASphereThatTouchesIsNotSafe) {
  const double touching = 0.28 + 0.25;
  for (const double gap : {-0.01, 0.01}) {
    const Metrics m = Compute(Standing({0, touching + gap, 1.5}, {0, 3.0, 1.5}));
    EXPECT_EQ(*m.safe_ratio, gap > 0.0 ? 1.0 : 0.0);
    EXPECT_NEAR(*m.min_clearance_m, gap, 1e-9);
  }
}

TEST(Metrics, GroundAndTargetCountForClearanceButNotForSight) {
  const Metrics low = Compute(Standing({5, 0, 0.2}, {8, 0, 0.5}));
  EXPECT_EQ(*low.safe_ratio, 0.0);
  EXPECT_NEAR(*low.min_clearance_m, -0.05, 1e-9);
  const Metrics close = Compute(Standing({5, 0, 1.5}, {5.3, 0, 1.5}));
  EXPECT_NEAR(*close.min_clearance_m, 0.3 - 0.15 - 0.25, 1e-9);
  EXPECT_EQ(*close.visible_ratio, 1.0);
}

/// Comes down from 1.5 m at 0.4 m/s from t = 2 s on, DONE 0.5 s after it stands.
FlightRecord Landing(double speed) {
  FlightRecord record = Standing({5, 0, 1.5}, {8, 0, 0.5});
  const double down = 2.0 + 1.38 / speed;
  record.states = {{-1.0, 3}, {1.5, 7}, {down + 0.5, 8}};
  for (TruthSample& s : record.truth) {
    s.p.z() = std::clamp(1.5 - speed * (s.t - 2.0), 0.12, 1.5);
    s.may_stand = s.t >= 1.5;
  }
  PlanSample hover;
  hover.certified_clearance = 1.0;
  hover.hard_radius = 0.37;
  hover.position = world::Trajectory::Constant({5, 0, 1.5}, -1.0, 2.0);
  record.plans = {hover};
  record.scenario.criteria.flight_states = {"CHASE", "LAND", "DONE"};
  record.scenario.criteria.touchdown_speed = 0.5;
  record.scenario.criteria.motors_off = 1.0;
  return record;
}

TEST(Metrics, ALandingIsJudgedByItsSpeedAndTheGroundIsNoHarm) {
  for (const double speed : {0.4, 0.6}) {
    const Metrics m = Compute(Landing(speed));
    EXPECT_EQ(*m.safe_ratio, 1.0);
    EXPECT_EQ(*m.certificate_kept_ratio, 1.0) << "nobody flies the plan any more";
    EXPECT_EQ(*m.tube_exceeded_ratio, 0.0);
    ASSERT_TRUE(m.touchdown_speed_mps.has_value());
    EXPECT_NEAR(*m.touchdown_speed_mps, speed, 0.02);
    EXPECT_NEAR(*m.motors_off_s, 0.5, 0.07);
    EXPECT_EQ(m.criteria.at("touchdown_speed"), speed < 0.5);
    EXPECT_TRUE(m.criteria.at("motors_off"));
    EXPECT_TRUE(m.criteria.at("flight_states"));
    EXPECT_EQ(m.flight_states.size(), 3u);
  }
  FlightRecord other = Landing(0.4);
  other.scenario.criteria.flight_states = {"LAND", "CHASE"};
  EXPECT_FALSE(Compute(other).criteria.at("flight_states")) << "not in that order";
  other.states.pop_back();
  EXPECT_FALSE(Compute(other).criteria.at("touchdown_speed")) << "it never was down";
}

/// A plan that hovers at x from t on, heard half a second before.
PlanSample Hover(int32_t seq, double t, double x, double clearance) {
  PlanSample plan;
  plan.seq = seq;
  plan.t = t, plan.heard = t - 0.5;
  plan.certified_clearance = clearance;
  plan.hard_radius = 0.37;
  plan.position = world::Trajectory::Constant({x, 0, 1.5}, t, 20.0);
  return plan;
}

TEST(Metrics, OnlyPlansThatControlFollowsAreFlown) {
  FlightRecord record = Standing({5, 0, 1.5}, {8, 0, 0.5});
  record.plans = {Hover(0, -2.0, 5.0, 1.0), Hover(1, 1.0, 9.0, 99.0), Hover(2, 5.02, 5.5, 1.0)};
  for (int k = -20; k <= 200; ++k)  // 1 is refused, 2 takes over between two messages
    record.tracking.push_back({0.05 * k, tracking_t::PLAN, 0.05 * k < 5.02 ? 0 : 2});
  Metrics m = Compute(record);
  EXPECT_EQ(*m.certificate_kept_ratio, 1.0);
  EXPECT_EQ(*m.certified_clearance_m, 1.0);
  EXPECT_NEAR(*m.tube_exceeded_ratio, 499.0 / 1001.0, 1e-9);
  EXPECT_NEAR(*m.tracking_error_p99_m, 0.5, 1e-9);
  for (TrackingSample& s : record.tracking)
    if (s.t > 7.0) s.following = tracking_t::BRAKE;
  m = Compute(record);
  EXPECT_NEAR(*m.certificate_kept_ratio, 0.7, 0.01) << "without a certificate";
  EXPECT_NEAR(*m.tube_exceeded_ratio, 2.0 / 7.0, 0.01) << "of the time under a plan";
  for (TrackingSample& s : record.tracking) s.plan_seq = -1;
  EXPECT_EQ(*Compute(record).certified_clearance_m, 1.0);
  EXPECT_NEAR(*Compute(record).certificate_kept_ratio, 1.0 - 4.02 / 10.0, 0.01)
      << "an older log tells of all plans only";
}

TEST(Metrics, TheTubeIsAboutThePlanInTheFrameThatItWasMadeIn) {
  FlightRecord record = Standing({5, 0, 1.5}, {8, 0, 0.5});
  record.plans = {Hover(0, -0.5, 5.3, 1.0)};  // the frame is off by 0.3 m
  record.tracking = {{-0.4, tracking_t::PLAN, 0}};
  const auto drift = [&](double rate) {
    record.poses.clear();
    for (int k = -150; k <= 1000; ++k) {
      const double t = 0.01 * k;
      record.poses.push_back({t, {5.3 + rate * std::max(0.0, t), 0.0, 1.5}});
    }
  };
  drift(0.0);
  EXPECT_NEAR(*Compute(record).tracking_error_p99_m, 0.0, 1e-9);
  EXPECT_EQ(*Compute(record).tube_exceeded_ratio, 0.0);
  for (TruthSample& s : record.truth) s.p.x() -= 0.03 * std::max(0.0, s.t);
  drift(-0.03);  // control does not follow
  EXPECT_NEAR(*Compute(record).tracking_error_p99_m, 0.3, 0.01);
  drift(0.0);  // the estimate drifts
  EXPECT_NEAR(*Compute(record).tracking_error_p99_m, 0.3, 0.01);
  record.plans.push_back(Hover(1, 5.5, 5.3, 1.0));  // heard at 5.0, off by 0.45 m by then
  record.tracking.push_back({5.5, tracking_t::PLAN, 1});
  EXPECT_NEAR(*Compute(record).tracking_error_p99_m, 0.165, 0.01);
}

// Odometry that began anew knows no north.
TEST(Metrics, TheTubeIsAboutThePlanInAFrameThatIsTurned) {
  FlightRecord record = Standing({5, 0, 1.5}, {8, 0, 0.5});
  record.plans = {Hover(0, -0.5, 0.0, 1.0)};
  auto& way = record.plans[0].position.coefficients;
  way.conservativeResize(2, 3);
  way.row(1) << -0.2 * record.plans[0].position.duration, 0.0, 0.0;
  record.tracking = {{-0.4, tracking_t::PLAN, 0}};
  for (TruthSample& s : record.truth) s.p.y() = 0.2 * (s.t + 0.5);
  for (int k = -150; k <= 1000; ++k) {
    const double t = 0.01 * k;
    record.poses.push_back({t, {-0.2 * (t + 0.5), 0.0, 1.5}, 0.5 * M_PI});
  }
  EXPECT_NEAR(*Compute(record).tracking_error_p99_m, 0.0, 1e-9);
}

TEST(Metrics, AWayDownByAPlanIsHeldAgainstIt) {
  FlightRecord record = Standing({5, 0, 1.5}, {8, 0, 0.5});
  record.plans = {Hover(0, -2.0, 5.0, 99.0)};
  record.states = {{-1.0, 3}, {4.0, 7}};  // CHASE, LAND
  for (int k = -20; k <= 200; ++k)
    record.tracking.push_back({0.05 * k, k < 120 ? tracking_t::PLAN : tracking_t::LAND, 0});
  for (TruthSample& s : record.truth)
    if (s.t >= 6.0) s.p.z() = 0.12;
  const Metrics m = Compute(record);
  EXPECT_EQ(*m.certificate_kept_ratio, 0.0);
  EXPECT_EQ(*m.tube_exceeded_ratio, 0.0) << "nobody flies the plan any more";
  EXPECT_NEAR(m.verdict_s.at(0), 6.0, 0.02);
  record.states.pop_back();
  record.plans[0].certified_clearance = 0.1;
  EXPECT_NEAR(*Compute(record).certificate_kept_ratio, 0.6, 0.01) << "nobody asked it to land";
}

void Tell(int8_t state, bool control, bool autopilot, LandingWatch* watch) {
  flight_state_t mission{};
  mission.state = state;
  tracking_t tracking{};
  tracking.following = control ? tracking_t::LAND : tracking_t::PLAN;
  status_t status{};
  status.name = "fcu";
  status.detail = autopilot ? "landing: no setpoints; simulated" : "simulated";
  watch->Hear(mission), watch->Hear(tracking), watch->Hear(status);
}

TruthSample Marked(TruthSample sample, LandingWatch* watch) {
  watch->Mark({}, &sample);
  return sample;
}

TEST(Metrics, ATouchOfTheGroundIsALandingByTheFlightsState) {
  const auto at = [](double height, double speed) {
    TruthSample sample{};
    sample.p.z() = height;
    sample.speed = speed;
    return sample;
  };
  const auto touches = [&](int8_t state, bool control, bool autopilot, double speed) {
    LandingWatch watch;
    Marked(at(1.5, 0.0), &watch);
    Tell(state, control, autopilot, &watch);
    return Marked(at(0.2, speed), &watch).may_stand;
  };
  EXPECT_TRUE(touches(flight_state_t::LAND, false, false, 3.0));
  EXPECT_TRUE(touches(flight_state_t::EMERGENCY, true, false, 0.7)) << "sinks without a velocity";
  EXPECT_TRUE(touches(-1, true, false, 0.7)) << "no mission leads it";
  EXPECT_FALSE(touches(-1, true, false, 0.8));
  EXPECT_FALSE(touches(flight_state_t::CHASE, false, false, 0.1));
  EXPECT_TRUE(touches(flight_state_t::CHASE, false, true, 0.5)) << "the autopilot lands";
  EXPECT_FALSE(touches(flight_state_t::CHASE, false, true, 0.8));
  LandingWatch watch;
  Tell(flight_state_t::EMERGENCY, false, false, &watch);
  EXPECT_TRUE(Marked(at(0.1, 0.0), &watch).may_stand) << "has not been up";
  EXPECT_FALSE(Marked(at(0.1, 2.0), &watch).may_stand) << "falls over";
  EXPECT_TRUE(Marked(at(0.1, 0.0), &watch).may_stand);
  Marked(at(1.5, 0.5), &watch);
  EXPECT_FALSE(Marked(at(0.1, 0.0), &watch).may_stand);
  Tell(flight_state_t::CHASE, false, true, &watch);
  Marked(at(0.4, 0.5), &watch);
  Tell(flight_state_t::CHASE, false, false, &watch);
  EXPECT_TRUE(Marked(at(0.2, 0.1), &watch).may_stand) << "broken off on the way down";
  Marked(at(0.7, 0.5), &watch);
  EXPECT_FALSE(Marked(at(0.2, 0.1), &watch).may_stand) << "it has been up since";
}

TEST(Metrics, AMissionThatBeginsAnewInFlightMakesNoLandingOfATouch) {
  for (const int8_t state : {flight_state_t::IDLE, flight_state_t::READY}) {
    for (const int8_t before : {flight_state_t::TAKEOFF, flight_state_t::CHASE,
                                flight_state_t::EMERGENCY, flight_state_t::DONE}) {
      LandingWatch watch;
      TruthSample sample{};
      const auto stands = [&](double height) {
        sample.p.z() = height;
        return Marked(sample, &watch).may_stand;
      };
      Tell(state, false, false, &watch);
      stands(1.5);
      EXPECT_TRUE(stands(0.2)) << "it has not flown";
      Tell(before, false, false, &watch);
      stands(1.5);
      Tell(state, false, false, &watch);
      EXPECT_EQ(stands(0.2), before == flight_state_t::DONE) << int{before};
    }
  }
}

TEST(Metrics, ASegmentThroughThePillarIsBlind) {
  EXPECT_EQ(*Compute(Standing({-2, 0, 1.5}, {2, 0, 1.5})).visible_ratio, 0.0);
  EXPECT_EQ(*Compute(Standing({-2, 0.29, 1.5}, {2, 0.29, 1.5})).visible_ratio, 1.0);
  EXPECT_EQ(*Compute(Standing({-2, 0.27, 1.5}, {2, 0.27, 1.5})).visible_ratio, 0.0);
  EXPECT_EQ(*Compute(Standing({-2, 0, 5.5}, {2, 0, 5.5})).visible_ratio, 1.0);  // over its top
}

TEST(Metrics, TheFirstContactIsToldWithItsTimeAndPartner) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  Metrics m = Compute(record);
  EXPECT_EQ(m.collision_s, -1.0);
  EXPECT_EQ(m.collided_with, "");
  for (TruthSample& s : record.truth)
    if (s.t > 3.994) s.p.x() = s.t < 7.0 ? 0.5 : 9.0;
  m = Compute(record);
  EXPECT_NEAR(m.collision_s, 4.0, 1e-9);
  EXPECT_EQ(m.collided_with, "cylinder at (0.0, 0.0)");
  EXPECT_FALSE(m.criteria.at("safe_ratio"));
  world::MoverSpec mover;
  mover.waypoints = {{20, 20, 1.5}};
  record.scenario.movers = {mover, mover};
  record.scenario.movers[1].waypoints = {{3, 0.5, 1.5}};
  EXPECT_EQ(Compute(record).collided_with, "mover 2");
  EXPECT_EQ(Compute(record).collision_s, 0.0);
  EXPECT_EQ(Compute(Standing({5, 0, 0.2}, {8, 0, 0.5})).collided_with, "ground");
  EXPECT_EQ(Compute(Standing({5, 0, 1.5}, {5.3, 0, 1.5})).collided_with, "target");
}

/// Of a drone that is told to be in LAND until 4 s, and DONE from then on.
void TellDone(FlightRecord* record) {
  LandingWatch watch;
  for (TruthSample& s : record->truth) {
    Tell(s.t < 4.0 ? flight_state_t::LAND : flight_state_t::DONE, false, false, &watch);
    watch.Mark({}, &s);
  }
}

TEST(Metrics, WhatTouchesTheDroneWhereItLiesAfterDoneIsNoCollision) {
  FlightRecord record = Standing({5, 0, 0.12}, {8, 0, 0.5});
  for (TruthSample& s : record.truth)
    if (s.t > 5.994) s.target = {5, 0, 0.5};
  TellDone(&record);
  Metrics m = Compute(record);
  EXPECT_EQ(m.collision_s, -1.0);
  EXPECT_EQ(*m.safe_ratio, 1.0);
  EXPECT_NEAR(m.struck_after_done_s, 6.0, 1e-9);
  EXPECT_GT(*m.min_clearance_m, 1.0);
  for (TruthSample& s : record.truth) s.done = s.t >= 7.0;
  m = Compute(record);
  EXPECT_NEAR(m.collision_s, 6.0, 1e-9) << "not yet DONE";
  EXPECT_NEAR(m.struck_after_done_s, 7.0, 1e-9);
  EXPECT_LT(*m.safe_ratio, 1.0);
}

TEST(Metrics, WhatFallsWithItsMotorsCutHasNotLanded) {
  FlightRecord record = Standing({5, 0, 2.0}, {8, 0, 0.5});
  for (TruthSample& s : record.truth) {
    if (s.t < 4.0) continue;
    s.speed = 9.81 * (s.t - 4.0);
    s.p.z() = 2.0 - 0.5 * 9.81 * std::pow(s.t - 4.0, 2);
    s.target = {5, 0, 0.6};
    if (s.p.z() < 0.12) s.p.z() = 0.12, s.speed = 0.0;
  }
  TellDone(&record);
  const Metrics m = Compute(record);
  EXPECT_GT(m.collision_s, 4.2);
  EXPECT_LT(m.collision_s, 4.6);
  EXPECT_EQ(m.collided_with, "target");
}

/// The named partner alone leaves the clearance as it is; without it there is more.
TEST(Metrics, TheNamedPartnerIsTheOneThatTheClearanceIsMeasuredTo) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> xy(-4.0, 4.0), z(0.3, 3.0);
  for (int trial = 0; trial < 300; ++trial) {
    FlightRecord record = Standing({xy(random), xy(random), z(random)}, {30, 0, 1.5});
    record.scenario.world.cylinders.push_back({{2.0, 1.0}, 0.4, 3.0, 0.0});
    record.scenario.world.boxes.push_back({{-2.0, -1.0, 1.0}, {1.0, 0.5, 2.0}, 30.0});
    record.scenario.world.ellipsoids.push_back({{1.0, -2.0, 1.0}, {0.5, 0.7, 0.9}, 0.0});
    const Scorer score(record.scenario);
    const TruthSample& s = record.truth[100];
    const std::string name = score.Nearest(s);
    FlightRecord rest = record;
    if (name == "cylinder at (0.0, 0.0)")
      rest.scenario.world.cylinders.erase(rest.scenario.world.cylinders.begin());
    if (name == "cylinder at (2.0, 1.0)") rest.scenario.world.cylinders.pop_back();
    if (name == "box at (-2.0, -1.0)") rest.scenario.world.boxes.clear();
    if (name == "ellipsoid at (1.0, -2.0)") rest.scenario.world.ellipsoids.clear();
    if (name == "ground") rest.scenario.world.ground.height = -10.0;
    EXPECT_GT(Scorer(rest.scenario)(s).clearance, score(s).clearance)
        << "trial " << trial << ": " << name;
  }
}

TEST(Metrics, FaultsThatStruckAreNamed) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  EXPECT_EQ(Compute(record).fault, "");
  EXPECT_EQ(Compute(record).fault_time_s, -1.0);
  record.faults = {{2.5, "lidar-gap"}, {4.0, "kill-planning"}};
  EXPECT_EQ(Compute(record).fault, "lidar-gap+kill-planning");
  EXPECT_EQ(Compute(record).fault_time_s, 2.5);
}

/// Random segments and points against dense sampling of the pillar.
TEST(Metrics, ScoresAgreeWithDenseSampling) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> xy(-2.0, 2.0), z(0.6, 2.4);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d p(xy(random), xy(random), z(random)), q(xy(random), xy(random), z(random));
    FlightRecord record = Standing(p, q);
    record.truth.resize(101);
    const SampleScore score = Score(record).at(0);
    double nearest_axis = 1e9;
    for (int i = 0; i <= 2000; ++i)
      nearest_axis = std::min(nearest_axis, (p + (q - p) * (i / 2000.0)).head<2>().norm());
    const bool grazing = std::abs(nearest_axis - 0.28) < 2e-3;
    EXPECT_TRUE(grazing || score.visible == (nearest_axis > 0.28)) << "trial " << trial;
    const double pillar = p.head<2>().norm() - 0.28 - 0.25;
    EXPECT_LE(score.clearance, pillar + 1e-9) << "trial " << trial;
  }
}

TEST(Metrics, MoversBlockAndTouchWhereTheyAreAtTheTime) {
  FlightRecord record = Standing({4, 0, 1.5}, {6, 0, 1.5});
  world::MoverSpec mover;
  mover.size = {0.5, 0.5, 0.5};
  mover.waypoints = {{5, -5, 1.5}, {5, 5, 1.5}};
  mover.speed = 1.0;
  record.scenario.movers.push_back(mover);
  double blocked = 0.0;
  for (const TruthSample& s : record.truth) {
    if (s.t < -1e-9 || s.t > 10.0 + 1e-9) continue;
    const auto solid = world::MoverAt(mover, s.t).solid;
    blocked += world::SegmentHits(solid, s.p, s.target) ? 1.0 : 0.0;
  }
  ASSERT_GT(blocked, 10.0);
  EXPECT_NEAR(*Compute(record).visible_ratio, 1.0 - blocked / 1001.0, 1e-12);
}

/// The chaser circles at 2 m radius and 1 rad/s, facing along its path, about a target that is
/// still but for a short drive.
TEST(Metrics, FiguresOfACircleAreTheClosedForms) {
  FlightRecord record = Standing({0, 0, 0}, {0, 0, 0});
  record.scenario.world.cylinders.clear();
  for (TruthSample& s : record.truth) {
    const double t = s.t;
    s.p = {2 * std::cos(t), 2 * std::sin(t), 5.0};
    s.a = {-2 * std::cos(t), -2 * std::sin(t), 0.0};
    s.yaw = std::remainder(t + M_PI / 2, 2 * M_PI);
    s.target = {0.0, 0.0, 3.5 + 0.1 * t};
  }
  const Metrics m = Compute(record);
  EXPECT_NEAR(*m.acceleration_cost, 4.0, 1e-9);
  EXPECT_NEAR(*m.jerk_cost, 4.0, 1e-3);
  EXPECT_NEAR(*m.yaw_rate_rms, 1.0, 1e-9);
  EXPECT_NEAR(*m.travel_ratio, 20.0, 1e-3);
  double ratio = 0.0, error = 0.0;
  for (int k = 0; k <= 1000; ++k) {
    const double d = std::hypot(2.0, 1.5 - 0.001 * k) / 2.5;
    ratio += d / 1001.0;
    error += std::abs(d - 1.0) / 1001.0;
  }
  EXPECT_NEAR(*m.distance_ratio, ratio, 1e-9);
  EXPECT_NEAR(*m.distance_error, error, 1e-9);
}

TEST(Metrics, EstimatesAreComparedAtTheSameTime) {
  FlightRecord record = Standing({0, 0, 0}, {0, 0, 0});
  for (TruthSample& s : record.truth) {
    s.p = {3 * std::cos(s.t), 3 * std::sin(s.t), s.t};
    s.target = {s.t, 0, 1};
  }
  const Eigen::Isometry3d shift =
      Eigen::Translation3d(0.3, 0.0, 0.4) * Eigen::AngleAxisd(0.0, Vector3d::UnitZ());
  for (double t = 0.0025; t < 9.9; t += 0.005) {  // between the truth's samples too
    record.poses.push_back({t, shift * Vector3d(3 * std::cos(t), 3 * std::sin(t), t)});
    record.targets.push_back({t, true, Vector3d(t, 0.2, 1)});
    record.targets.push_back({t, false, Vector3d(99, 99, 99)});
  }
  const Metrics m = Compute(record);
  EXPECT_NEAR(*m.odometry_ate_m, 0.5, 1e-4);
  EXPECT_NEAR(*m.odometry_ate_aligned_m, 0.0, 1e-4);
  EXPECT_NEAR(*m.target_rmse_m, 0.2, 1e-9);
}

TEST(Metrics, EstimatesOfALaterEpochAreJudgedInItsOwnFrame) {
  FlightRecord record = Standing({0, 0, 0}, {0, 0, 0});
  for (TruthSample& s : record.truth) {
    s.p = {3 * std::cos(s.t), 3 * std::sin(s.t), 1.0};
    s.target = {s.t, 0, 1};
  }
  const Eigen::Isometry3d later =
      Eigen::Translation3d(4.0, 5.0, -1.0) * Eigen::AngleAxisd(0.5 * M_PI, Vector3d::UnitZ());
  for (int k = 0; k < 990; ++k) {
    const double t = 0.01 * k;
    const bool anew = t > 4.995;
    const Eigen::Isometry3d frame = anew ? later : Eigen::Isometry3d::Identity();
    const int32_t epoch = anew ? 9 : 7;
    record.poses.push_back({t, frame * Vector3d(3 * std::cos(t), 3 * std::sin(t), 1.0),
                            anew ? 0.5 * M_PI : 0.0, epoch});
    record.targets.push_back(
        {t, true, frame * Vector3d(t, 0.2, 1), frame.linear() * Vector3d::UnitX(), true, epoch});
    if (k % 100 != 50) continue;
    PredictionSample p{t, true, {t, 1.0, Eigen::MatrixXd::Zero(2, 3)}, epoch};
    p.target.coefficients.row(0) = frame * Vector3d(t, 0.3, 1);
    p.target.coefficients.row(1) = frame.linear() * Vector3d::UnitX();
    record.predictions.push_back(p);
  }
  const Metrics m = Compute(record);
  EXPECT_NEAR(*m.odometry_ate_m, 0.0, 1e-9);
  EXPECT_NEAR(*m.odometry_ate_aligned_m, 0.0, 1e-9);
  EXPECT_NEAR(*m.target_rmse_m, 0.2, 1e-9);
  EXPECT_NEAR(*m.prediction_error_m, 0.3, 1e-9);
  EXPECT_NEAR(m.prediction_error_constant_velocity_by_horizon_m.at(1.0), 0.2, 1e-9);
  record.targets.push_back({9.99, true, Vector3d(99, 99, 99), Vector3d::Zero(), true, 11});
  EXPECT_NEAR(*Compute(record).target_rmse_m, 0.2, 1e-9) << "no POSE is of that epoch";
}

TEST(Metrics, PredictionsAreJudgedAtTheirHorizon) {
  FlightRecord record = Standing({0, 0, 0}, {0, 0, 0});
  for (TruthSample& s : record.truth) s.target = {0.5 * s.t * s.t, 0, 0};  // accelerates at 1
  for (int k = 0; k < 8; ++k) {
    PredictionSample p;
    p.t = k;
    p.usable = true;
    p.target.start = k;
    p.target.duration = 2.0;
    p.target.coefficients = Eigen::MatrixXd::Zero(2, 3);
    p.target.coefficients(0, 0) = 0.5 * k * k;
    p.target.coefficients(1, 0) = k * 2.0;  // constant velocity
    record.predictions.push_back(p);
    p.usable = false;
    p.target.coefficients.setConstant(77.0);
    record.predictions.push_back(p);
  }
  const Metrics m = Compute(record);
  EXPECT_NEAR(*m.prediction_error_m, 0.5, 1e-9);
  EXPECT_NEAR(m.prediction_error_by_horizon_m.at(2.0), 2.0, 1e-9);
  EXPECT_EQ(m.prediction_error_by_horizon_m.count(2.5), 0u);
}

TEST(Metrics, AStraightLineIsJudgedBesideThePredictions) {
  FlightRecord record = Standing({0, 0, 0}, {0, 0, 0});
  for (TruthSample& s : record.truth) s.target = {0.5 * s.t * s.t, 0, 0};  // accelerates at 1
  for (int k = 0; k < 8; ++k)
    record.predictions.push_back({k * 1.0, true, {k * 1.0, 2.0, Eigen::MatrixXd::Zero(1, 3)}});
  EXPECT_TRUE(Compute(record).prediction_error_constant_velocity_by_horizon_m.empty());
  const std::string key = "prediction_error_constant_velocity_by_horizon_m";
  EXPECT_TRUE(nlohmann::json::parse(MetricsJson(record, Compute(record))).at(key).is_null());
  for (int k = 0; k < 100; ++k) {
    const double t = 0.1 * k - 0.05;  // the newest is 0.05 s older than the prediction
    record.targets.push_back({t, false, {0.5 * t * t, 0.3, 0}, {t, 0, 0}, true});
    record.targets.push_back({t, false, {99, 99, 99}, Vector3d::Zero(), false});  // lost
  }
  const auto errors = Compute(record).prediction_error_constant_velocity_by_horizon_m;
  for (const double horizon : {0.5, 1.0, 1.5, 2.0})
    EXPECT_NEAR(errors.at(horizon), std::hypot(0.5 * std::pow(horizon + 0.05, 2), 0.3), 1e-6);
  EXPECT_EQ(errors.count(2.5), 0u) << "no prediction reaches that far";
  const auto json = nlohmann::json::parse(MetricsJson(record, Compute(record)));
  EXPECT_NEAR(json.at(key).at("1.0"), errors.at(1.0), 1e-5);
}

TEST(Metrics, PlansAndStagesAreCounted) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  const std::vector<std::pair<double, int>> plans = {{-0.5, 5}, {0.0, 0}, {1.0, 1},
                                                     {2.0, 2},  {3.0, 3}, {4.0, 4}};
  for (const auto& [t, verdict] : plans) record.plans.push_back({t, verdict, {}, {}});
  record.stages.push_back({"planning", "plan", 10, 1.0, 2.0, 3.0, 4.0});
  const Metrics m = Compute(record);
  EXPECT_EQ(m.replans, 5);
  EXPECT_EQ(m.fallbacks, 3);
  EXPECT_EQ(m.plan_ms->p99, 3.0);
  EXPECT_FALSE(m.predict_ms);
}

TEST(Metrics, CountsPlansOfTheMissionWhereThereAreAny) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  EXPECT_TRUE(nlohmann::json::parse(MetricsJson(record, Compute(record))).at("replans").is_null());
  EXPECT_TRUE(
      nlohmann::json::parse(MetricsJson(record, Compute(record))).at("fallbacks").is_null());
  for (const auto& [t, verdict] : {std::pair(-0.5, plan_t::WAIT), {0.0, plan_t::WAIT}})
    record.plans.push_back({t, verdict, {}, {}});
  record.plans.push_back({1.0, plan_t::CHASE, {}, {}});
  record.plans.push_back({2.0, plan_t::WAIT, {}, {}});
  EXPECT_EQ(Compute(record).fallbacks, 2) << "those of 0 and 2 s";
  EXPECT_EQ(nlohmann::json::parse(MetricsJson(record, Compute(record))).at("replans"), 3);
}

TEST(Metrics, SweepsOfTheMissionAreTimedToTheirSetpoint) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  EXPECT_FALSE(Compute(record).sweep_to_setpoint_ms);
  record.scenario.criteria.sweep_to_setpoint = 0.12;
  EXPECT_TRUE(Compute(record).Passed()) << "a log without sweeps";
  record.sweep_to_setpoint_ms = {{-0.5, 900.0}};
  for (int i = 0; i < 100; ++i) record.sweep_to_setpoint_ms.push_back({0.1 * i, 50.0 + 0.5 * i});
  const Metrics m = Compute(record);
  EXPECT_NEAR(m.sweep_to_setpoint_ms->p50, 74.5, 1e-9);
  EXPECT_NEAR(m.sweep_to_setpoint_ms->p99, 99.0, 1e-9);
  EXPECT_NEAR(m.sweep_to_setpoint_ms->max, 99.5, 1e-9);
  EXPECT_TRUE(m.criteria.at("sweep_to_setpoint"));
  for (auto& [t, ms] : record.sweep_to_setpoint_ms) ms += 30.0;
  EXPECT_FALSE(Compute(record).criteria.at("sweep_to_setpoint"));
}

TEST(Metrics, MemoryIsComparedWithThatOfAProcessAMinuteOld) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.scenario.criteria.memory_growth = 0.05;
  record.memory["mapping"] = {
      {1.0, 50.0}, {59.0, 90.0}, {60.5, 100.0}, {70.0, 104.0}, {80.0, 102.0}};
  record.memory["planning"] = {{1.0, 50.0}, {59.0, 90.0}};
  Metrics m = Compute(record);
  EXPECT_EQ(m.memory_growth.count("planning"), 0u) << "younger than a minute";
  EXPECT_NEAR(m.memory_growth.at("mapping"), 0.04, 1e-9);
  EXPECT_TRUE(m.criteria.at("memory_growth"));
  record.memory["mapping"].insert(record.memory["mapping"].end(),
                                  {{1.0, 70.0}, {61.0, 150.0}, {62.0, 156.0}});
  m = Compute(record);
  EXPECT_NEAR(m.memory_growth.at("mapping"), 0.04, 1e-9) << "another process";
  record.memory["mapping"].push_back({63.0, 159.0});
  EXPECT_FALSE(Compute(record).criteria.at("memory_growth"));
}

/// Starts at 1 m/s along x, and accelerates by `a` for the second that it lasts.
PlanSample Along(double t, int verdict, double certified, double a) {
  PlanSample plan{t, verdict, {}, {}, certified};
  plan.position = {t, 1.0, Eigen::MatrixXd::Zero(3, 3)};
  plan.position.coefficients(1, 0) = 1.0;
  plan.position.coefficients(2, 0) = 0.5 * a;
  return plan;
}

TEST(Metrics, LastResortsWithoutACertificateAreCounted) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.plans = {Along(0.0, plan_t::CHASE, 0.1, 1.0),   Along(1.0, plan_t::BRAKE, 0.1, -1.0),
                  Along(2.0, plan_t::BRAKE, -1.0, -1.0), Along(3.0, plan_t::MITIGATE, -1.0, 1.0),
                  Along(4.0, plan_t::WAIT, -1.0, 0.0),   Along(5.0, plan_t::BRAKE, 0.1, 0.04),
                  Along(6.0, plan_t::BRAKE, 0.1, 0.06),  Along(-1.0, plan_t::BRAKE, -1.0, 1.0),
                  Along(10.5, plan_t::BRAKE, -1.0, 1.0)};
  Metrics m = Compute(record);
  EXPECT_EQ(m.plans_in_air, 7);
  EXPECT_EQ(m.uncertified_brakes, 2);
  EXPECT_EQ(m.accelerating_brakes, 1);
  record.plans[1].stop = record.plans[1].position.Reparametrised(1.5, 1.0);
  record.plans[1].stop->coefficients(2, 0) = 0.5;  // ends at 1.5 m/s
  EXPECT_EQ(Compute(record).accelerating_brakes, 2);
  record.states = {
      {-2.0, flight_state_t::TAKEOFF}, {1.5, flight_state_t::CHASE}, {5.5, flight_state_t::LAND}};
  m = Compute(record);
  EXPECT_EQ(m.plans_in_air, 4) << "neither in the climb nor on the way down";
  EXPECT_EQ(m.accelerating_brakes, 0);
  const auto json = nlohmann::json::parse(MetricsJson(record, m));
  EXPECT_EQ(json.at("plans_in_air"), 4);
  EXPECT_EQ(json.at("uncertified_brakes"), 2);
  EXPECT_EQ(json.at("accelerating_brakes"), 0);
}

TEST(Metrics, TheTimeUnderEveryVerdictIsTold) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  for (int v = plan_t::CHASE; v <= plan_t::MITIGATE; ++v)
    record.plans.push_back({v * 1.0, v, {}, {}});
  const auto seconds = nlohmann::json::parse(MetricsJson(record, Compute(record))).at("verdict_s");
  EXPECT_EQ(seconds.size(), 8u);
  for (const char* name : {"chase", "wider", "kept", "safe_only", "brake", "wait", "escape"})
    EXPECT_NEAR(seconds.at(name), 1.0, 0.011) << name;
  EXPECT_NEAR(seconds.at("mitigate"), 3.0, 0.011) << "from 7 s to the end of 10 s";
}

TEST(Metrics, CriteriaFollowTheScenario) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.scenario.criteria = {1.0, 0.95, 0.9, 1.2, 0.95, {}, -1.0, -1.0, -1.0, -1.0};
  record.real_time_factor = 0.99;
  Metrics m = Compute(record);
  EXPECT_TRUE(m.Passed());
  EXPECT_EQ(m.criteria.size(), 8u);
  record.real_time_factor = 0.9;
  EXPECT_FALSE(Compute(record).criteria.at("real_time_factor"));
  record.scenario.criteria.real_time_factor = -1.0;
  EXPECT_TRUE(Compute(record).Passed());
  record.scenario.criteria.distance_ratio_max = 0.9;
  EXPECT_FALSE(Compute(record).criteria.at("distance_ratio_max"));
}

TEST(Metrics, AFlightWhoseLogLostWhatItMustHoldFails) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  ChannelInfo imu;
  imu.channel = "IMU";
  imu.count = 990;
  imu.missing = 10;
  record.log.channels = {imu};
  EXPECT_FALSE(Compute(record).criteria.at("recorded")) << "a light channel";
  EXPECT_EQ(Compute(record).lost_messages.at("IMU"), 10);
  record.log.channels[0].channel = "CAMERA_IMAGE";
  EXPECT_TRUE(Compute(record).Passed());
  record.log.channels[0].missing = 11;
  EXPECT_FALSE(Compute(record).criteria.at("recorded"));
  record.log.channels[0].missing_first = 1;  // a recorder drops the oldest
  EXPECT_TRUE(Compute(record).Passed());
  record.log.damage = {{1000, 10, true}};
  EXPECT_FALSE(Compute(record).Passed());
  EXPECT_EQ(Compute(record).losses.size(), 1u);
}

TEST(Metrics, WhoStartsAnewWithoutAFaultFailsWhereThatIsAsked) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.log.restarts = {{"mapping", 1}, {"planning", 2}};
  EXPECT_TRUE(Compute(record).Passed()) << "not asked";
  EXPECT_EQ(Compute(record).restarts.at("planning"), 2);
  record.scenario.criteria.restarts = 0;
  record.faults = {{1.0, "kill-planning"}, {2.0, "freeze-mapping"}, {3.0, "kill-mapping"}};
  EXPECT_FALSE(Compute(record).criteria.at("restarts")) << "planning once more";
  record.faults.push_back({4.0, "kill-planning"});
  EXPECT_TRUE(Compute(record).criteria.at("restarts"));
}

TEST(Metrics, AFlightWithASetpointThatIsNoNumberFails) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  EXPECT_TRUE(Compute(record).criteria.at("finite_setpoints"));
  record.nonfinite_setpoints = 1;
  EXPECT_EQ(Compute(record).nonfinite_setpoints, 1);
  EXPECT_FALSE(Compute(record).criteria.at("finite_setpoints"));
  EXPECT_FALSE(Compute(record).Passed());
}

TEST(Metrics, AFlightThatStopsEarlyFails) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.truth.resize(900);
  const Metrics m = Compute(record);
  EXPECT_EQ(*m.safe_ratio, 1.0);
  EXPECT_FALSE(m.criteria.at("complete"));
  EXPECT_FALSE(m.Passed());
}

TEST(Metrics, AFlightWhoseBeginningIsNotThereFails) {
  FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  record.truth.erase(record.truth.begin(), record.truth.begin() + 109);  // up to 0.08 s
  EXPECT_TRUE(Compute(record).criteria.at("complete"));
  record.truth.erase(record.truth.begin(), record.truth.begin() + 9);
  EXPECT_FALSE(Compute(record).criteria.at("complete"));
}

TEST(Metrics, AnEmptyFlightHasNoFiguresAndFails) {
  FlightRecord record;
  const Metrics m = Compute(record);
  EXPECT_FALSE(m.safe_ratio);
  EXPECT_FALSE(m.Passed());
  const auto json = nlohmann::json::parse(MetricsJson(record, m));
  EXPECT_TRUE(json.at("safe_ratio").is_null());
}

TEST(Metrics, JsonHasTheAgreedKeys) {
  const FlightRecord record = Standing({3, 0, 1.5}, {5.5, 0, 1.5});
  const auto json = nlohmann::json::parse(MetricsJson(record, Compute(record)));
  for (const char* key : {"safe_ratio",
                          "min_clearance_m",
                          "visible_ratio",
                          "in_image_ratio",
                          "distance_ratio",
                          "distance_error",
                          "travel_ratio",
                          "acceleration_cost",
                          "jerk_cost",
                          "yaw_rate_rms",
                          "plan_ms",
                          "predict_ms",
                          "replans",
                          "fallbacks",
                          "odometry_ate_m",
                          "target_rmse_m",
                          "prediction_error_m",
                          "cpu_s",
                          "criteria",
                          "fault",
                          "fault_time_s",
                          "flown_s",
                          "collision_s",
                          "collided_with",
                          "struck_after_done_s",
                          "faults",
                          "reaction_s",
                          "recovery_s",
                          "nonfinite_setpoints"})
    EXPECT_TRUE(json.contains(key)) << key;
}

TEST(TruthAt, InterpolatesOnlyOverSmallGaps) {
  std::vector<TruthSample> truth(3);
  truth[0].t = 0.0;
  truth[1].t = 0.01;
  truth[1].p.x() = 1.0;
  truth[2].t = 5.0;
  EXPECT_NEAR(TruthAt(truth, 0.0025)->body.x(), 0.25, 1e-12);
  EXPECT_FALSE(TruthAt(truth, 1.0));
  EXPECT_FALSE(TruthAt(truth, -1.0));
  EXPECT_FALSE(TruthAt(truth, 6.0));
  EXPECT_TRUE(TruthAt(truth, 5.0));
  EXPECT_FALSE(TruthAt({}, 0.0));
}

}  // namespace
}  // namespace chase::logs
