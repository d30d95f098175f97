#include "services/planning/planning_node.h"

#include <gtest/gtest.h>

#include "chase/geofence_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"

namespace chase::planning {
namespace {

constexpr int64_t kStart = 1000000;  // us
constexpr int64_t kPeriod = 5000;    // us between poses

polynomial_t Line(int64_t utime, const Eigen::Vector3d& from, const Eigen::Vector3d& velocity) {
  polynomial_t m{};
  m.utime = utime;
  m.duration = 2.5;
  m.n_coefficients = 6;
  for (int i = 0; i < 3; ++i) m.coefficients.push_back(from[i]);
  for (int i = 0; i < 3; ++i) m.coefficients.push_back(2.5 * velocity[i]);
  return m;
}

constexpr int64_t kNever = kStart + 1000000000;  // us

/// What else happens in a flight.
struct Events {
  std::string sender = "company";  // of all messages
  int64_t unseen_from = kNever;    // unseen places are told of, us
  double height = 0.1;             // where the body is before there is a plan, m
  int64_t obeys_from =
      kStart;  // the autopilot does from then on, and stands on the ground until then
  int64_t flying_from = kNever;              // control says from then on that it flies, us
  double bound = 0.0;                        // that control says of its error, m
  int64_t frame_at = kNever;                 // the frame of odometry changes, us
  int64_t obstacles_at = kNever;             // obstacles speak of the new one, us
  int64_t forecasts_at = kNever;             // forecasts do, us
  int64_t cut_from = kNever;                 // lists leave something out from then on, us
  int64_t well_from = kStart;                // odometry is lost until then, us
  bool returns = false;                      // mission wants it back, 5 m along x
  bool is_fenced = false;                    // inside a fence that has a notch across that way
  std::vector<std::string>* said = nullptr;  // by planning's status
};

/// Plays the drone and the target: hovers where the newest plan wants it, forecasts a straight
/// walk.
class Company : public bus::Node {
 public:
  Company(bus::Bus& bus, int64_t forecast_from, int64_t forecast_until, const Events& events)
      : bus_(bus), from_(forecast_from), until_(forecast_until), events_(events) {
    bus.Subscribe<plan_t>("PLAN", [this](const plan_t& m) { plans.push_back(m); });
    bus.Subscribe<status_t>("PLANNING_STATUS", [this](const status_t& m) {
      if (events_.said) events_.said->push_back(m.detail);
    });
  }
  int64_t TickPeriod() const override { return kPeriod; }
  void Tick(int64_t utime) override {
    if (utime >= from_ && utime < until_ && (utime - from_) % 200000 == 0) Forecast(utime);
    if ((utime - kStart) % 100000 == 0) {
      obstacles_t none{};
      none.utime = utime;
      none.epoch = utime >= events_.obstacles_at;
      none.n_cut = utime >= events_.cut_from;
      if (utime >= events_.unseen_from) bus_.Publish("UNSEEN", none);
      bus_.Publish("OBSTACLES", none);
    }
    if (events_.obeys_from > kStart && (utime - kStart) % 1000000 == 0) Autopilot(utime);
    if (utime >= events_.flying_from && (utime - kStart) % 50000 == 0) {
      tracking_t tracking{};
      tracking.utime = utime;
      tracking.following = tracking_t::PLAN;
      tracking.bound = events_.bound;
      bus_.Publish("TRACKING", tracking);
    }
    if (events_.returns && (utime - kStart) % 100000 == 0) Lead(utime);
    pose_t pose{};
    pose.utime = utime;
    pose.epoch = utime >= events_.frame_at;
    pose.orientation[0] = 1.0;
    pose.health = utime >= events_.well_from ? pose_t::HEALTH_DEGRADED : pose_t::HEALTH_LOST;
    bus::Set(pose.pos, Position(utime));
    bus_.Publish("POSE", pose);
  }
  std::vector<plan_t> plans;

 private:
  Eigen::Vector3d Position(int64_t utime) const {
    Eigen::Vector3d p(0.0, 0.0, events_.height);
    for (const plan_t& plan : plans) {
      if (plan.utime > utime) continue;
      const auto x = bus::FromMessage(plan.position, kStart);
      p = x.Position(std::min(bus::Seconds(utime, kStart), x.end()));
    }
    return p;
  }
  // Under a mission, and with control.
  void Autopilot(int64_t utime) {
    status_t status{};
    status.utime = utime;
    status.name = "fcu";
    status.detail = utime >= events_.obeys_from ? "flying: armed; mode OFFBOARD, armed, on ground"
                                                : "arming: x; mode OFFBOARD, disarmed, on ground";
    bus_.Publish("FCU_STATUS", status);
    flight_state_t state{};
    state.utime = utime;
    state.state = flight_state_t::TAKEOFF;
    bus_.SetIdentity({"mission", "", kStart});
    bus_.Publish("FLIGHT_STATE", state);
    tracking_t tracking{};
    tracking.utime = utime;
    bus_.Publish("TRACKING", tracking);
  }
  void Lead(int64_t utime) {
    flight_state_t state{};
    state.utime = utime;
    state.state = flight_state_t::RETURN;
    state.has_home = 1;
    state.home[0] = 5.0;
    bus_.SetIdentity({"mission", "", kStart});
    bus_.Publish("FLIGHT_STATE", state);
    state.utime -= 50000;  // one of before, that was overtaken
    state.state = flight_state_t::HOLD;
    bus_.Publish("FLIGHT_STATE", state);
    if (!events_.is_fenced) return;
    geofence_t fence{};
    fence.corners = {-1, -1, 2, -1, 2, 3, 4, 3, 4, -1, 6, -1, 6, 4, -1, 4};
    fence.n_corners = static_cast<int32_t>(fence.corners.size());
    fence.floor = -1.0;
    fence.ceiling = 5.0;
    bus_.Publish("GEOFENCE", fence);
  }
  void Forecast(int64_t utime) {
    prediction_t m{};
    m.utime = utime;
    m.epoch = utime >= events_.forecasts_at;
    const double t = bus::Seconds(utime, from_);
    m.target = Line(utime, {2.5 + 0.8 * t, 0.0, 0.6}, {0.8, 0.0, 0.0});
    for (const int i : {0, 4, 8}) m.covariance[i] = m.velocity_covariance[i] = 1e-4;
    bus_.Publish("PREDICTION", m);
  }

  bus::Bus& bus_;
  int64_t from_, until_;
  Events events_;
};

std::vector<plan_t> Fly(int64_t forecast_from, int64_t forecast_until, int64_t end,
                        const Events& events = {}) {
  bus::Lockstep lockstep(kStart);
  Company* company = nullptr;
  lockstep.Add(events.sender, 0, [&](bus::Bus& bus) {
    auto node = std::make_unique<Company>(bus, forecast_from, forecast_until, events);
    company = node.get();
    return node;
  });
  lockstep.Add("planning", 2000,
               [](bus::Bus& bus) { return std::make_unique<PlanningNode>(bus, PlanningConfig{}); });
  lockstep.RunUntil(end);
  return company->plans;
}

bus::Bus::Bytes Bytes(const std::vector<plan_t>& plans) {
  bus::Bus::Bytes all;
  for (const plan_t& plan : plans) {
    bus::Bus::Bytes bytes(static_cast<size_t>(plan.getEncodedSize()));
    plan.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  return all;
}

TEST(PlanningNode, ClimbsAndWaitsWithoutAForecast) {
  const auto plans = Fly(kStart + 100000000, 0, kStart + 6000000);
  ASSERT_FALSE(plans.empty());
  for (const plan_t& plan : plans) EXPECT_EQ(+plan.verdict, +plan_t::WAIT) << plan.reason;
  const auto last = bus::FromMessage(plans.back().position, kStart);
  EXPECT_NEAR(last.Position(last.end()).z(), 0.1 + PlanningConfig{}.takeoff_height, 1e-6);
}

TEST(PlanningNode, ClimbsOnceTheAutopilotObeys) {
  Events events;
  events.obeys_from = kStart + 8000000;
  const auto plans = Fly(kNever, kNever, kStart + 15000000, events);
  ASSERT_FALSE(plans.empty());
  EXPECT_GE(plans.front().utime, events.obeys_from);
  EXPECT_EQ(plans.front().reason, "climbing");
}

TEST(PlanningNode, SaysWhatAClimbWaitsFor) {
  std::vector<std::string> said;
  Events events;
  events.said = &said;
  events.obeys_from = kStart + 8000000;
  events.well_from = kStart + 3500000;
  Fly(kNever, kNever, kStart + 7000000, events);
  const std::vector<std::string> wanted = {"waiting for a pose", "waiting for ten lists in a row",
                                           "waiting for the autopilot"};
  said.erase(std::unique(said.begin(), said.end()), said.end());
  EXPECT_EQ(said, wanted);
}

TEST(PlanningNode, ClimbsAfterTenSweepsInARowOfWhichThePlaceWasKnown) {
  Events events;
  events.well_from = kStart + 3000000;
  const auto plans = Fly(kNever, kNever, kStart + 6000000, events);
  ASSERT_FALSE(plans.empty());
  EXPECT_GE(plans.front().utime, events.well_from + 900000);
  EXPECT_LE(plans.front().utime, events.well_from + 1100000);
}

TEST(PlanningNode, ChasesAForecastWithoutJumpsFromPlanToPlan) {
  const auto plans = Fly(kStart + 5000000, kStart + 9000000, kStart + 9000000);
  int chases = 0;
  for (size_t i = 1; i < plans.size(); ++i) {
    chases += plans[i].verdict == plan_t::CHASE;
    const auto before = bus::FromMessage(plans[i - 1].position, kStart);
    const auto now = bus::FromMessage(plans[i].position, kStart);
    const double t = std::min(now.start, before.end());
    EXPECT_LT((before.Position(t) - now.Position(now.start)).norm(), 1e-6) << "plan " << i;
    EXPECT_LT((before.Velocity(t) - now.Velocity(now.start)).norm(), 1e-6) << "plan " << i;
  }
  EXPECT_GE(chases, 10);
}

TEST(PlanningNode, StopsAndLooksAroundWhenTheForecastsStop) {
  const auto plans = Fly(kStart + 5000000, kStart + 7000000, kStart + 30000000);
  ASSERT_FALSE(plans.empty());
  EXPECT_TRUE(plans.back().verdict == +plan_t::BRAKE || plans.back().verdict == +plan_t::WAIT);
  EXPECT_FALSE(plans.back().reason.empty());
  const auto last = bus::FromMessage(plans.back().position, kStart);
  EXPECT_LT(last.Velocity(last.end()).norm(), 1e-6);
}

TEST(PlanningNode, TheSameMessagesGiveTheSameBytes) {
  EXPECT_EQ(Bytes(Fly(kStart + 5000000, kStart + 7000000, kStart + 8000000)),
            Bytes(Fly(kStart + 5000000, kStart + 7000000, kStart + 8000000)));
}

TEST(PlanningNode, APlannerStartedInFlightDoesNotClimb) {
  Events events;
  events.height = 1.5;
  events.flying_from = kStart + 100000;  // heard a little after the first poses
  const auto plans = Fly(kNever, kNever, kStart + 5000000, events);
  ASSERT_FALSE(plans.empty());
  for (const plan_t& plan : plans) {
    const auto way = bus::FromMessage(plan.position, kStart);
    EXPECT_NEAR(way.Position(way.end()).z(), events.height, 0.01) << plan.reason;
  }
}

TEST(PlanningNode, StartedInFlightItCertifiesNothingUntilMappingTellsWhatNobodyHasSeen) {
  for (const int64_t unseen_from : {kStart, kStart + 500000}) {
    Events events;
    events.sender = "mapping";
    events.unseen_from = unseen_from;
    events.height = 1.5;
    events.flying_from = kStart;
    const auto plans = Fly(kStart + 100000, kNever, kStart + 4000000, events);
    int blind = 0, chases = 0;
    for (const plan_t& plan : plans) {
      const bool is_certified = plan.certified_clearance >= 0.0;
      blind += plan.utime < unseen_from && is_certified;
      chases += plan.utime >= unseen_from && plan.verdict == plan_t::CHASE;
    }
    EXPECT_EQ(blind, 0);
    EXPECT_GT(chases, 10);
  }
}

TEST(PlanningNode, TheTubeIsAsWideAsControlSaysThatItStrays) {
  const PlannerConfig config;
  for (const auto& [bound, tube] :
       {std::pair(0.05, config.tracking_tube), {0.2, 0.2}, {9.0, 0.3}}) {
    Events events;
    events.height = 1.5;
    events.flying_from = kStart;
    events.bound = bound;
    const auto plans = Fly(kStart + 500000, kNever, kStart + 2000000, events);
    ASSERT_FALSE(plans.empty());
    EXPECT_NEAR(plans.back().hard_radius, config.drone_radius + tube, 1e-12) << bound;
  }
}

TEST(PlanningNode, KeepsTheWayBackInsideTheFenceThatMissionTells) {
  for (const bool is_fenced : {false, true}) {
    Events events;
    events.height = 1.5;
    events.flying_from = kStart;
    events.returns = true;
    events.is_fenced = is_fenced;
    const auto plans = Fly(kNever, kNever, kStart + 15000000, events);
    ASSERT_FALSE(plans.empty());
    const auto last = bus::FromMessage(plans.back().position, kStart);
    const double x = last.Position(last.end()).x();
    if (is_fenced)
      EXPECT_LT(x, 2.0 - PlanningConfig{}.planner.tracking_tube);
    else
      EXPECT_NEAR(x, 5.0, 0.1);
  }
}

struct Chases {
  int before = 0, between = 0, after = 0;
};

/// Chases of a target in a flight whose frame changes after 8 s; what is heard is of the new one
/// from the given times on.
Chases ChasesInAnotherFrame(int64_t obstacles_at, int64_t forecasts_at) {
  Events events;
  events.frame_at = kStart + 8000000;
  events.obstacles_at = obstacles_at;
  events.forecasts_at = forecasts_at;
  const int64_t all_at = std::max(obstacles_at, forecasts_at);
  Chases chases;
  for (const plan_t& plan : Fly(kStart + 5000000, kStart + 12000000, kStart + 12000000, events)) {
    const bool is_old = plan.epoch == 0, is_between = !is_old && plan.utime < all_at;
    int& n = is_old ? chases.before : is_between ? chases.between : chases.after;
    n += plan.verdict <= plan_t::SAFE_ONLY;
    EXPECT_FALSE(is_between && plan.utime < obstacles_at && plan.certified_clearance >= 0.0)
        << "among the obstacles of another frame";
  }
  return chases;
}

TEST(PlanningNode, AListThatIsCutCertifiesNothing) {
  Events events;
  events.cut_from = kStart + 6000000;
  for (const plan_t& plan : Fly(kStart + 4000000, kNever, kStart + 8000000, events)) {
    if (plan.utime < kStart + 5000000) continue;
    const bool counts = plan.utime < events.cut_from + 200000;
    if (counts || plan.utime > events.cut_from + 400000) {
      EXPECT_EQ(plan.certified_clearance >= 0.0, counts) << plan.utime - kStart << plan.reason;
    }
  }
}

TEST(PlanningNode, AnotherFrameVoidsForecastAndObstacles) {
  const int64_t change = kStart + 8000000, later = kStart + 10000000;
  for (const bool forecasts_last : {true, false}) {
    const Chases chases =
        forecasts_last ? ChasesInAnotherFrame(change, later) : ChasesInAnotherFrame(later, change);
    EXPECT_GT(chases.before, 10);
    EXPECT_EQ(chases.between, 0) << (forecasts_last ? "forecasts" : "obstacles");
    EXPECT_GT(chases.after, 3);
  }
}

}  // namespace
}  // namespace chase::planning
