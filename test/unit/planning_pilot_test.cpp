#include <gtest/gtest.h>

#include <cmath>

#include "services/planning/pilot.h"

namespace chase::planning {
namespace {

constexpr double kPeriod = 0.005;

Forecast Walking(double t) {
  Forecast f;
  f.t = t;
  f.has_target = true;
  f.target = {t, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  f.target.coefficients << 2.5 + 0.8 * t, 0.0, 0.5, 0.8 * 2.5, 0.0, 0.0;
  f.radius = 0.3;
  f.height = 1.0;
  f.velocity_covariance = 0.04 * Eigen::Matrix3d::Identity();
  return f;
}

/// Flies the pilot's plans perfectly.
class Flight {
 public:
  explicit Flight(const PlanningConfig& config) : pilot(config) {}

  void Run(double seconds, bool with_target) {
    for (const double end = t + seconds; t < end; t += kPeriod) {
      if (hears && std::fmod(t, 0.1) < kPeriod) {
        pilot.SetObstacles(t, obstacles);
        if (!unseen.empty()) pilot.SetUnseen(t, unseen);
      }
      if (with_target && std::fmod(t, 0.3) < kPeriod) pilot.SetForecast(Walking(t));
      if (const auto plan = pilot.Update(t, Body())) {
        plans.push_back(*plan);
        waiting = *plan;
      }
      if (waiting && waiting->trajectory.start <= t) Switch();
      if (flown) largest_step = std::max(largest_step, (Body().p - last).norm());
      last = Body().p;
    }
  }

  BodyEstimate Body() const {
    if (!flown) return {{0.0, 0.0, 0.1}, {0.0, 0.0, 0.0}, 0.0};
    const world::Trajectory &plan = flown->trajectory, &way = FlownAt(t);
    const double now = std::min(t, way.end());
    const double tau = std::min(1.0, (t - plan.start) / plan.duration);
    return {way.Position(now), way.Velocity(now), YawAt(flown->yaw, tau, plan.duration).yaw};
  }

  /// As control does it: a plan until its stop begins, then that.
  const world::Trajectory& FlownAt(double time) const {
    return flown->stop && time >= flown->stop->start ? *flown->stop : flown->trajectory;
  }

  Pilot pilot;
  double t = 0.0;
  bool hears = true;  // of obstacles
  std::vector<world::Obstacle> obstacles, unseen;
  double largest_step = 0.0, largest_kink = 0.0;
  std::vector<PlanResult> plans;
  std::optional<PlanResult> flown, waiting;

 private:
  void Switch() {
    if (flown) {
      const double start = waiting->trajectory.start;
      const world::Trajectory& way = FlownAt(start);
      largest_kink = std::max(
          largest_kink,
          (way.Position(std::min(start, way.end())) - waiting->trajectory.Position(start)).norm());
    }
    flown = waiting;
    waiting.reset();
  }
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
};

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
std::vector<PlanResult> AfterTheLastSight(double yaw, double bearing, double speed, double radius) {
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
    }
    const auto plan = pilot.Update(t, body);
    if (plan && plan->reason.find("target lost") == 0) plans.push_back(*plan);
  }
  return plans;
}

bool Goes(const PlanResult& plan) {
  return plan.reason.find("target lost, to where it may be") == 0;
}

TEST(Pilot, SearchesFartherForWhoWasFast) {
  const auto goes = [](double speed) {
    const auto plans = AfterTheLastSight(0.0, 0.0, speed, 0.3);
    return std::count_if(plans.begin(), plans.end(), Goes);
  };
  EXPECT_GT(goes(3.0), goes(0.0));
}

// Where it would be by its last forecast there is nobody to keep off.
TEST(Pilot, ALostTargetsBodyIsInNobodysWay) {
  const auto plans = AfterTheLastSight(0.0, 0.0, 3.0, 0.3);
  const auto free = AfterTheLastSight(0.0, 0.0, 3.0, 0.0);
  ASSERT_EQ(plans.size(), free.size());
  for (size_t i = 0; i < plans.size(); ++i) {
    EXPECT_EQ(Goes(plans[i]), Goes(free[i])) << i;
    if (!Goes(free[i])) continue;
    EXPECT_EQ(plans[i].trajectory.coefficients, free[i].trajectory.coefficients) << i;
  }
}

TEST(Pilot, TurnsToALostTargetTheShorterWay) {
  for (const double side : {1.0, -1.0}) {
    const auto plans = AfterTheLastSight(side * 3.0, side * -3.0, 0.0, 0.3);
    ASSERT_FALSE(plans.empty());
    EXPECT_GT(side * YawAt(plans[0].yaw, 0.0, plans[0].trajectory.duration).rate, 0.0);
  }
}

TEST(Pilot, FollowsNobodyToWhereNobodyHasLooked) {
  for (const bool looked : {true, false}) {
    Flight flight{PlanningConfig()};
    world::Obstacle dark;
    dark.id = 3;
    dark.solid = world::Obstacle::Solid::kBox;
    dark.center = world::Trajectory::Constant({9.0, 0.0, 2.0}, 0.0, 100.0);
    dark.half = {0.5, 30.0, 2.0};
    dark.shape = (std::sqrt(3.0) * dark.half).cwiseAbs2().cwiseInverse().asDiagonal();
    if (!looked) flight.unseen = {dark};
    flight.Run(3.0, false);
    flight.Run(12.0, true);
    EXPECT_EQ(flight.Body().p.x() > 8.5 - PlanningConfig().planner.hard_radius(), looked);
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
  pilot.Update(0.0, {zero, zero, 0.0});
  for (double t = 0.005; t < 5.0; t += kPeriod) {
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

TEST(Pilot, OutdatedUnseenPlacesCountAsOutdatedObstacles) {
  for (const bool heard : {false, true}) {
    Flight flight{PlanningConfig()};
    flight.Run(4.0, false);
    if (heard) flight.pilot.SetUnseen(flight.t, {});
    flight.Run(2.0, true);
    EXPECT_EQ(flight.plans.back().reason.find("obstacles are not heard of") == 0, heard);
  }
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

TEST(Pilot, AnObstacleOnTheRunningPlanIsAnsweredAtOnce) {
  const PlanningConfig config;
  for (const bool in_the_way : {true, false}) {
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
    const Eigen::Vector3d aside(0.0, in_the_way ? 0.0 : 5.0, 0.0);
    pillar.center = world::Trajectory::Constant(plan.Position(plan.end()) + aside, flight.t, 1.0);
    flight.pilot.SetObstacles(flight.t, {pillar});
    const auto answer = flight.pilot.Update(flight.t, flight.Body());
    EXPECT_EQ(answer.has_value(), in_the_way);
  }
}

// A climb ends where nobody looks on its way up, too.
TEST(Pilot, WithoutObstaclesItDoesNotChaseAfterTheClimbEither) {
  Flight flight{PlanningConfig()};
  flight.hears = false;
  flight.Run(6.0, true);
  for (const PlanResult& plan : flight.plans) EXPECT_EQ(plan.verdict, Verdict::kWait);
  EXPECT_LT(flight.plans.back().certified_clearance, 0.0);
}

// What is not known of a walker grows until it is everywhere: nothing to flee from.
TEST(Pilot, WithoutObstaclesItBrakesAndFleesFromNobody) {
  Flight flight{PlanningConfig()};
  world::Obstacle walker;
  walker.solid = world::Obstacle::Solid::kCylinder;
  walker.half = {0.25, 0.25, 0.9};
  walker.shape = (2.0 * walker.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  walker.moving = true;
  walker.velocity_covariance = 0.25 * Eigen::Matrix3d::Identity();
  walker.center = world::Trajectory::Constant({4.0, 0.5, 0.9}, 0.0, 1.0);
  flight.obstacles = {walker};
  flight.Run(6.0, false);
  const Eigen::Vector3d at = flight.Body().p;
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
    EXPECT_LT(s.a.norm() + s.j.norm(), 1e-6) << off;
    EXPECT_NEAR(YawAt(next->yaw, 0.0, next->trajectory.duration).yaw, far ? 0.3 : yaw, 1e-6);
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
