#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/world/ages.h"
#include "common/world/random.h"
#include "services/planning/pilot.h"
#include "test/unit/planning_claim.h"

// Whole flights of the pilot behind a target that goes round among pillars, is lost for a while and
// found again: each plan follows from the one before, in time, and holds for whoever checks it.

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.01, kSeen = 0.3, kListed = 0.1;  // s
constexpr double kRound = 3.0, kSpeed = 0.8;                  // m, m/s
constexpr double kClimbed = 4.0;                              // s; the target waits until then

struct Course {
  std::function<Forecast(double)> forecast;
  std::vector<world::Obstacle> obstacles;
  double lost, found, end;  ///< s
};

/// Constant acceleration from now on.
Forecast ForecastOf(double t, const Vector3d& p, const Vector3d& v, const Vector3d& a) {
  constexpr double kHorizon = 2.5;
  Forecast f;
  f.t = t;
  f.has_target = true;
  f.target = {t, kHorizon, Eigen::MatrixXd::Zero(3, 3)};
  f.target.coefficients.row(0) = p.transpose();
  f.target.coefficients.row(1) = kHorizon * v.transpose();
  f.target.coefficients.row(2) = 0.5 * kHorizon * kHorizon * a.transpose();
  f.covariance = 0.03 * 0.03 * Eigen::Matrix3d::Identity();
  f.velocity_covariance = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
  f.radius = 0.3;
  f.height = 1.7;
  return f;
}

Forecast GoingRound(double t) {
  const double angle = kSpeed / kRound * t;
  const Vector3d along(std::cos(angle), std::sin(angle), 0.0), inwards(-along.y(), along.x(), 0.0);
  const Vector3d p = kRound * Vector3d(along.y(), 1.0 - along.x(), 0.0) + Vector3d(0.0, 0.0, 0.85);
  return ForecastOf(t, p, kSpeed * along, kSpeed * kSpeed / kRound * inwards);
}

/// Away from the target's round and from the place of the start.
std::vector<world::Obstacle> RandomPillars(unsigned seed) {
  world::Random random(seed, 3);
  std::vector<world::Obstacle> pillars;
  while (pillars.size() < 6) {
    const Vector3d p(random.Uniform(-6.0, 6.0), random.Uniform(-3.0, 9.0), 1.5);
    const double off = std::abs((p.head<2>() - Eigen::Vector2d(0.0, kRound)).norm() - kRound);
    if (off < 1.2 || p.head<2>().norm() < 3.5) continue;
    world::Obstacle o;
    o.id = static_cast<int>(pillars.size());
    o.solid = world::Obstacle::Solid::kCylinder;
    o.half = {0.25, 0.25, 2.0};
    o.shape = (2.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    o.center = world::Trajectory::Constant(p, 0.0, 1.0);
    o.position_covariance.diagonal().setConstant(1e-4);
    pillars.push_back(o);
  }
  return pillars;
}

struct Counts {
  int plans = 0, chases = 0, of = 0, searches = 0, certified = 0;
};

class Flown {
 public:
  Flown(const Course& course, unsigned seed, const Vector3d& home = {-2.5, 0.0, 0.1})
      : course_(course), seed_(seed), home_(home) {}

  void Fly(Counts* counts) {
    double seen = -1.0, listed = -1.0;
    for (; t_ < course_.end; t_ += kPeriod) {
      if (t_ - listed > kListed - 1e-9) pilot_.SetObstacles(listed = t_, course_.obstacles);
      const bool visible = t_ < course_.lost || t_ > course_.found;
      const bool told = visible || t_ > course_.lost + world::kMostAge.target_unseen;
      if (told && t_ - seen > kSeen - 1e-9) {
        Forecast nobody;
        nobody.t = seen = t_;
        if (visible) forecast_ = course_.forecast(t_);
        pilot_.SetForecast(visible ? forecast_ : nobody);
      }
      pilot_.SetFlying(!plans_.empty());
      if (const auto plan = pilot_.Update(t_, Body())) Take(*plan, counts);
    }
  }

  const std::vector<PlanResult>& plans() const { return plans_; }

  // Flies each plan from its start on.
  BodyEstimate Body() const {
    const auto flown = std::find_if(plans_.rbegin(), plans_.rend(),
                                    [&](const PlanResult& p) { return p.trajectory.start <= t_; });
    if (flown == plans_.rend()) return {home_, Vector3d::Zero(), 0.0};
    const world::Trajectory& way = flown->trajectory;
    const double now = std::min(t_, way.end()), tau = (now - way.start) / way.duration;
    return {way.Position(now), t_ < way.end() ? way.Velocity(now) : Vector3d::Zero(),
            YawAt(flown->yaw, tau, way.duration).yaw};
  }

 private:
  void Take(const PlanResult& plan, Counts* counts) {
    if (!plans_.empty() && plans_.back().reason != "climbing") Follows(plans_.back(), plan);
    const std::string bad =
        world::Refute(ClaimOf(plan, forecast_.target, config_.planner),
                      {config_.planner.hard_radius(), config_.planner.sigmas}, course_.obstacles);
    if (plan.reason != "climbing") {
      EXPECT_EQ(bad, "") << seed_ << " " << t_ << " " << Name(plan.verdict) << plan.reason;
      ++counts->plans;
      counts->certified += plan.certified_clearance >= 0.0;
    }
    const bool sight = plan.verdict <= Verdict::kKept;
    const double stale = course_.lost + world::kMostAge.prediction + kPeriod;
    const bool gone = t_ > stale && t_ < course_.found;
    EXPECT_FALSE(sight && gone) << t_;
    EXPECT_TRUE(sight || !plan.reason.empty()) << Name(plan.verdict);
    const bool settled = (t_ > kClimbed + 2.0 && t_ < course_.lost) || t_ > course_.found + 3.0;
    counts->of += settled;
    counts->chases += settled && sight;
    counts->searches += gone && plan.reason.find("lost") != std::string::npos;
    plans_.push_back(plan);
  }

  // It begins where and as the one before is then, neither too soon nor too late after it.
  void Follows(const PlanResult& before, const PlanResult& plan) const {
    const double start = plan.trajectory.start, gap = start - before.trajectory.start;
    EXPECT_NEAR(start, t_ + config_.latency, 1e-9);
    EXPECT_GE(gap, config_.min_period - 1e-6) << t_;
    EXPECT_LE(gap, config_.replan_period + kPeriod + 1e-6) << t_;
    const double then = std::min(start, before.trajectory.end());
    EXPECT_LT((plan.trajectory.Position(start) - before.trajectory.Position(then)).norm(), 1e-6);
    const double tau = (then - before.trajectory.start) / before.trajectory.duration;
    const double yaw = YawAt(before.yaw, tau, before.trajectory.duration).yaw;
    EXPECT_NEAR(YawAt(plan.yaw, 0.0, plan.trajectory.duration).yaw, yaw, 1e-6) << t_;
    if (start < before.trajectory.end()) {
      EXPECT_LT((plan.trajectory.Velocity(start) - before.trajectory.Velocity(start)).norm(), 1e-6);
    }
  }

  PlanningConfig config_;
  Pilot pilot_{config_};
  Course course_;
  unsigned seed_;
  Vector3d home_;
  double t_ = 0.0;
  Forecast forecast_;
  std::vector<PlanResult> plans_;
};

TEST(Flights, EachPlanFollowsFromTheOneBeforeAndHolds) {
  Counts counts;
  for (unsigned seed = 0; seed < 8; ++seed)
    Flown({GoingRound, RandomPillars(seed), 12.0, 16.0, 22.0}, seed).Fly(&counts);
  std::printf("%d plans, %d certified; in sight %d of %d; %d of searches\n", counts.plans,
              counts.certified, counts.chases, counts.of, counts.searches);
  EXPECT_GE(counts.chases, 0.9 * counts.of);
  EXPECT_GT(counts.searches, 8);
  EXPECT_GE(counts.certified, 0.95 * counts.plans);
}

// Where the frame has its origin does not matter: the same flight elsewhere, a search that goes
// somewhere among it, as not all draws of pillars ask for one.
TEST(Flights, AreTheSameElsewhere) {
  const Vector3d away(32.0, -16.0, 8.0);
  const auto forecast = [&](double t) {
    Forecast f = GoingRound(t);
    f.target.coefficients.row(0) += away.transpose();
    return f;
  };
  // The ground is listed, so that heights count from there.
  world::Obstacle ground;
  ground.id = 99;
  ground.ground = true;
  ground.solid = world::Obstacle::Solid::kBox;
  ground.half = {30.0, 30.0, 0.3};
  ground.shape = (3.0 * ground.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  ground.center = world::Trajectory::Constant({0.0, 0.0, -0.3}, 0.0, 1.0);
  Course here{GoingRound, RandomPillars(4), 10.0, 20.0, 21.0};
  here.obstacles.push_back(ground);
  Course there = here;
  there.forecast = forecast;
  for (world::Obstacle& o : there.obstacles) o.center.coefficients.row(0) += away.transpose();
  const Vector3d home(-2.5, 0.0, 0.1);
  Counts counts;
  Flown a(here, 3, home), b(there, 3, home + away);
  a.Fly(&counts);
  b.Fly(&counts);
  ASSERT_EQ(a.plans().size(), b.plans().size());
  int searches = 0;
  for (size_t i = 0; i < a.plans().size(); ++i) {
    const PlanResult &x = a.plans()[i], &y = b.plans()[i];
    ASSERT_EQ(x.reason, y.reason) << i;
    ASSERT_EQ(x.verdict, y.verdict) << i;
    for (double tau = 0.0; tau <= 1.0; tau += 0.1)
      ASSERT_LT((x.trajectory.Position(x.trajectory.start + tau * x.trajectory.duration) + away -
                 y.trajectory.Position(y.trajectory.start + tau * y.trajectory.duration))
                    .norm(),
                1e-3)
          << i << x.reason;
    searches += x.reason.find("to where it may be") != std::string::npos;
  }
  EXPECT_GT(searches, 0);
}

}  // namespace
}  // namespace chase::planning
