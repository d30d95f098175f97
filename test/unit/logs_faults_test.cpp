#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "chase/flight_state_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/world/ages.h"
#include "logs/src/metrics.h"

namespace chase::logs {
namespace {

constexpr double kEnd = 10.0;  // s

/// Ten seconds in which all goes well but for what a test leaves out: OBSTACLES at 10 Hz, 0.1 s old
/// when they are heard, POSE at 200 Hz, TARGET and FLIGHT_STATE at 10 Hz, plans at 25 Hz whose stop
/// begins after 0.2 s, and what control follows at 20 Hz.
struct Flown {
  FlightRecord record;

  Flown() {
    record.scenario.duration_s = kEnd;
    record.scenario.chaser.desired_distance = 2.5;
    for (int k = 0; k <= 1000; ++k) {
      TruthSample s;
      s.t = 0.01 * k;
      s.p = {0.1 * s.t, 0.0, 1.5};
      s.target = s.p + Eigen::Vector3d(2.5, 0.0, -1.0);
      record.truth.push_back(s);
    }
    for (int k = 0; k <= 100; ++k) Hear("OBSTACLES", 0.1 * k, 0.1);
    for (int k = 0; k <= 100; ++k) Hear("TARGET", 0.1 * k, 0.05);
    for (int k = 0; k <= 2000; ++k) Hear("POSE", 0.005 * k, 0.002);
    for (int k = 0; k <= 250; ++k) Plan(0.04 * k, plan_t::CHASE);
    for (int k = 0; k <= 200; ++k)
      Track(0.05 * k, tracking_t::PLAN, static_cast<int32_t>(0.05 * k / 0.04));
  }

  void Hear(const std::string& channel, double t, double age) {
    record.heard[channel].push_back({t, t - age});
  }
  void Plan(double t, int verdict) {
    PlanSample p;
    p.heard = t;
    p.t = t + 0.01;
    p.verdict = verdict;
    p.certified_clearance = 0.3;
    p.seq = static_cast<int32_t>(record.plans.size());
    p.position = world::Trajectory::Constant({0, 0, 1.5}, p.t, 2.5);
    p.stop = world::Trajectory::Constant({0, 0, 1.5}, t + 0.2, 1.0);
    record.plans.push_back(p);
  }
  void Track(double t, int following, int32_t plan) {
    record.tracking.push_back({t, following, plan});
  }
  void Silence(const std::string& channel, double from, double until) {
    auto& samples = record.heard[channel];
    samples.erase(std::remove_if(samples.begin(), samples.end(),
                                 [&](const auto& s) { return s.t > from && s.t < until; }),
                  samples.end());
  }
  void Verdict(int verdict, double from, double until) {
    for (PlanSample& p : record.plans)
      if (p.heard > from && p.heard < until) p.verdict = verdict;
  }
  void Follow(int following, double from, double until) {
    for (TrackingSample& s : record.tracking)
      if (s.t > from && s.t < until) s.following = following;
  }
  void Lead() { record.states = {{0.0, flight_state_t::CHASE, "asked for"}}; }
  FaultFigures Figures(const std::string& name, double at, std::optional<double> end) {
    record.faults = {{at, name, end}};
    return Compute(record).faults.at(0);
  }
};

TEST(Faults, WhatTouchesNoInputAsksForNoReactionAndNoRecovery) {
  Flown flown;
  const FaultFigures f = flown.Figures("gust", 4.0, 6.0);
  EXPECT_FALSE(f.reaction_s);
  EXPECT_EQ(f.input, "");
  EXPECT_LE(f.recovery_s.value(), 0.051) << "the next that control says";
}

TEST(Faults, ReactionCountsFromTheAgeLimitToThePlanThatBrakes) {
  Flown flown;
  flown.Silence("OBSTACLES", 5.01, 6.99);  // 4.9 s was the newest
  flown.Verdict(plan_t::BRAKE, 5.33, 7.15);
  const FaultFigures f = flown.Figures("lidar-gap", 4.95, 6.0);
  EXPECT_EQ(f.input, "OBSTACLES");
  EXPECT_NEAR(f.reaction_s.value(), 5.36 - (4.9 + world::kMostAge.obstacles), 1e-9);
  // The plan of 7.16 s is the first that chases, and control says so at 7.2 s.
  EXPECT_NEAR(f.recovery_s.value(), 7.2 - 6.0, 1e-9);
}

TEST(Faults, AStopThatControlFliesIsAReactionToo) {
  Flown flown;
  flown.Silence("OBSTACLES", 5.01, 6.99);
  flown.Follow(tracking_t::STOP, 5.24, 7.0);
  EXPECT_NEAR(flown.Figures("lidar-gap", 4.95, 6.0).reaction_s.value(), 5.25 - 5.2, 1e-9);
  Flown before;
  before.Silence("OBSTACLES", 5.01, 6.99);
  before.Follow(tracking_t::STOP, 5.1, 7.0);
  EXPECT_EQ(before.Figures("lidar-gap", 4.95, 6.0).reaction_s, 0.0) << "it stopped already";
  Flown again;  // it did stop, but flies on by the limit
  again.Silence("OBSTACLES", 5.01, 6.99);
  again.Follow(tracking_t::STOP, 5.1, 5.18);
  again.Follow(tracking_t::STOP, 5.52, 7.0);
  EXPECT_NEAR(again.Figures("lidar-gap", 4.95, 6.0).reaction_s.value(), 5.55 - 5.2, 1e-9);
}

TEST(Faults, WithoutAReactionItIsAsLateAsTheInputIsBack) {
  Flown flown;
  flown.Silence("OBSTACLES", 5.01, 6.99);
  EXPECT_NEAR(flown.Figures("lidar-gap", 4.95, 6.0).reaction_s.value(), 7.0 - 5.2, 1e-9);
  flown.Silence("OBSTACLES", 5.01, 20.0);
  EXPECT_NEAR(flown.Figures("lidar-dead", 4.95, {}).reaction_s.value(), kEnd - 5.2, 1e-9);
}

TEST(Faults, AnInputThatIsLateAllAlongIsOverdueOnce) {
  Flown flown;
  for (HeardSample& s : flown.record.heard["OBSTACLES"])
    if (s.t > 4.01 && s.t < 6.99) s.stamp -= 0.3;  // none is younger than 0.4 s
  flown.Verdict(plan_t::BRAKE, 4.5, 7.0);
  const FaultFigures f = flown.Figures("delay-OBSTACLES", 4.0, 7.0);
  EXPECT_NEAR(f.reaction_s.value(), 4.52 - 4.1, 1e-9);
}

TEST(Faults, WhatIsNotSeenMayBeTooOldWhileObstaclesAreFresh) {
  Flown flown;
  for (int k = 0; k <= 100; ++k) flown.Hear("UNSEEN", 0.1 * k, k > 40 && k < 70 ? 0.4 : 0.1);
  flown.Verdict(plan_t::BRAKE, 4.5, 7.0);
  const FaultFigures f = flown.Figures("delay-UNSEEN", 4.0, 7.0);
  EXPECT_EQ(f.input, "UNSEEN");
  EXPECT_NEAR(f.reaction_s.value(), 4.52 - 4.1, 1e-9);
}

TEST(Faults, AForecastThatIsTooOldIsChasedNoLonger) {
  Flown flown;
  for (int k = 0; k <= 100; ++k) flown.Hear("PREDICTION", 0.1 * k, 0.05);
  flown.Silence("PREDICTION", 4.01, 6.99);
  flown.Verdict(plan_t::SAFE_ONLY, 5.51, 7.2);
  const FaultFigures f = flown.Figures("freeze-prediction", 4.0, 6.0);
  EXPECT_EQ(f.input, "PREDICTION");
  EXPECT_NEAR(f.reaction_s.value(), 5.52 - (3.95 + world::kMostAge.prediction), 1e-9);
}

TEST(Faults, SilentSetpointsAreTheAutopilots) {
  Flown flown;
  for (int k = 0; k <= 2000; ++k) flown.Hear("ATTITUDE_SETPOINT", 0.005 * k, 0.001);
  flown.Silence("ATTITUDE_SETPOINT", 4.001, 5.999);
  FaultFigures f = flown.Figures("freeze-control", 4.0, 6.0);
  EXPECT_EQ(f.input, "ATTITUDE_SETPOINT");
  EXPECT_NEAR(f.reaction_s.value(), 6.0 - (3.999 + world::kMostAge.setpoint), 1e-9);
  flown.record.autopilot = {{1.0, false}, {4.505, true}, {6.0, false}};
  f = flown.Figures("freeze-control", 4.0, 6.0);
  EXPECT_NEAR(f.reaction_s.value(), 4.505 - (3.999 + world::kMostAge.setpoint), 1e-9);
}

TEST(Faults, PosesAndPlansAreControls) {
  Flown flown;
  flown.Silence("POSE", 5.001, 5.999);
  flown.Verdict(plan_t::BRAKE, 5.0, 5.05);  // no answer to this
  flown.Follow(tracking_t::BRAKE, 5.22, 6.0);
  FaultFigures f = flown.Figures("kill-odometry", 5.0, 5.5);
  EXPECT_EQ(f.input, "POSE");
  EXPECT_NEAR(f.reaction_s.value(), 5.25 - (4.998 + world::kMostAge.pose), 1e-9);
  Flown planless;
  auto& plans = planless.record.plans;
  plans.erase(std::remove_if(plans.begin(), plans.end(),
                             [](const auto& p) { return p.heard > 5.001 && p.heard < 6.999; }),
              plans.end());
  planless.Follow(tracking_t::STOP, 5.22, 7.0);
  f = planless.Figures("freeze-planning", 5.0, 7.0);
  EXPECT_EQ(f.input, "PLAN");
  EXPECT_NEAR(f.reaction_s.value(), 5.25 - 5.2, 1e-9) << "from where its certified stop begins";
}

TEST(Faults, WhoLeadsTheFlightReactsToALostTarget) {
  Flown flown;
  flown.Silence("TARGET", 5.01, 6.99);
  EXPECT_FALSE(flown.Figures("freeze-perception", 5.0, 7.0).reaction_s) << "nobody leads it";
  flown.Lead();
  flown.record.states.push_back({5.6, flight_state_t::SEARCH, "target lost"});
  const FaultFigures f = flown.Figures("freeze-perception", 5.0, 7.0);
  EXPECT_EQ(f.input, "TARGET");
  EXPECT_NEAR(f.reaction_s.value(), 5.6 - (4.95 + world::kMostAge.target), 1e-9);
}

TEST(Faults, WhoeverFallsSilentAboveThemIsNoticed) {
  Flown flown;
  flown.Lead();
  for (int k = 0; k <= 40; ++k) flown.Hear("FLIGHT_STATE", 0.1 * k, 0.0);
  flown.Verdict(plan_t::BRAKE, 6.1, 20.0);
  const FaultFigures f = flown.Figures("freeze-mission", 4.0, 7.0);
  EXPECT_EQ(f.input, "FLIGHT_STATE");
  EXPECT_NEAR(f.reaction_s.value(), 6.12 - (4.0 + world::kMostAge.flight_state), 1e-9);
}

TEST(Faults, WhatWasOverdueBeforeOrRanOutLaterIsNotItsDoing) {
  Flown flown;
  flown.Silence("OBSTACLES", 3.01, 4.99);  // overdue from 3.2 s
  flown.Silence("OBSTACLES", 7.01, 8.99);
  EXPECT_FALSE(flown.Figures("gust", 3.5, 6.0).reaction_s);
  EXPECT_TRUE(flown.Figures("gust", 3.5, 7.05).reaction_s) << "it ran out while the fault lasted";
}

TEST(Faults, RecoveredIsACertifiedPlanThatIsFlownOrRestOnTheGround) {
  Flown flown;
  flown.Verdict(plan_t::SAFE_ONLY, 5.0, 20.0);
  EXPECT_FALSE(flown.Figures("lidar-gap", 5.0, 6.0).recovery_s);
  flown.Verdict(plan_t::KEPT, 7.5, 20.0);
  EXPECT_NEAR(flown.Figures("lidar-gap", 5.0, 6.0).recovery_s.value(), 7.55 - 6.0, 1e-9);
  flown.Follow(tracking_t::STOP, 7.0, 8.03);
  EXPECT_NEAR(flown.Figures("lidar-gap", 5.0, 6.0).recovery_s.value(), 8.05 - 6.0, 1e-9)
      << "it has to be flown";
  for (PlanSample& p : flown.record.plans)
    if (p.heard < 9.01) p.certified_clearance = -1.0;
  EXPECT_NEAR(flown.Figures("lidar-gap", 5.0, 6.0).recovery_s.value(), 9.05 - 6.0, 1e-9)
      << "and certified";
  EXPECT_FALSE(flown.Figures("lidar-dead", 5.0, {}).recovery_s) << "it never ends";
  flown.Lead();
  flown.record.states.push_back({8.5, flight_state_t::DONE, "landed"});
  EXPECT_NEAR(flown.Figures("lidar-gap", 5.0, 6.0).recovery_s.value(), 2.5, 1e-9);
}

TEST(Faults, ControlThatComesDownByItselfIsAtRestWhenItMovesNoMore) {
  Flown flown;
  flown.Follow(tracking_t::LAND, 5.5, 20.0);
  EXPECT_FALSE(flown.Figures("kill-odometry", 5.0, 6.0).recovery_s) << "it moves to the end";
  for (TruthSample& s : flown.record.truth)
    s.p = {1.0, 0.0, std::max(0.1, 1.5 - 0.7 * (s.t - 6.0))};
  EXPECT_NEAR(flown.Figures("kill-odometry", 5.0, 6.0).recovery_s.value(), 1.4 / 0.7, 0.05);
}

TEST(Faults, TheLongestOfSeveralCountsAndNoneWhereOneWasNotRecoveredFrom) {
  Flown flown;
  flown.Silence("OBSTACLES", 3.01, 3.49);
  flown.Silence("OBSTACLES", 5.01, 6.99);
  flown.record.faults = {{3.0, "lidar-gap", 3.4}, {5.0, "lidar-gap", 6.0}, {8.0, "motor-80", {}}};
  Metrics m = Compute(flown.record);
  EXPECT_EQ(m.fault, "lidar-gap+lidar-gap+motor-80");
  EXPECT_NEAR(*m.reaction_s, 7.0 - 5.2, 1e-9);
  EXPECT_NEAR(*m.recovery_s, 0.0, 1e-9) << "it flew on when each ended";
  flown.Verdict(plan_t::BRAKE, 5.9, 20.0);
  m = Compute(flown.record);
  EXPECT_TRUE(m.faults[0].recovery_s);
  EXPECT_FALSE(m.recovery_s);
  const auto json = nlohmann::json::parse(MetricsJson(flown.record, m));
  EXPECT_EQ(json["faults"].size(), 3u);
  EXPECT_EQ(json["faults"][1]["input"], "OBSTACLES");
  EXPECT_EQ(json["faults"][1]["end_s"], 6.0);
  EXPECT_TRUE(json["faults"][2]["end_s"].is_null());
  EXPECT_TRUE(json["recovery_s"].is_null());
  EXPECT_NEAR(json["faults"][0]["reaction_s"], 3.5 - 3.2, 1e-9);
  EXPECT_NEAR(json["reaction_s"], 5.92 - 5.2, 1e-9);
}

}  // namespace
}  // namespace chase::logs
