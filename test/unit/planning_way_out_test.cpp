#include <gtest/gtest.h>

#include <algorithm>

#include "test/unit/planning_ways.h"

// Where a plan may be left, judged by sampled distances.

namespace chase::planning {
namespace {

// The first that moves is the target's body, which is listed elsewhere.
void MakeTarget(PlanRequest* request) {
  auto& obstacles = request->obstacles;
  const auto at = std::find_if(obstacles.begin(), obstacles.end(),
                               [](const world::Obstacle& o) { return o.moving; });
  if (at == obstacles.end()) return;
  request->target_body = *at;
  request->target_body->id = kTargetId;
  obstacles.erase(at);
}

// A plan that could be left for 0.4 s on end, within 1.1 s of its start and before it meets what
// moves, has a stop; one that can be left in time is, and early.
TEST(WayOut, IsFoundWhereThePlanCanBeLeftForAWhile) {
  const PlannerConfig config;
  PlannerConfig hard = config;
  hard.safety_margin = 0.0;
  constexpr double kTouch = 1e-3;  // m
  int late = 0, none = 0;
  for (unsigned seed = 0; seed < 2000; ++seed) {
    PlanRequest request = RandomRequest(config, seed);
    if (seed % 2 == 1) MakeTarget(&request);
    Random random(seed, 8);
    world::Trajectory plan{request.t0, 2.0, Eigen::MatrixXd::Zero(3, 3)};  // that bends
    plan.coefficients.row(0) = request.start.p.transpose();
    plan.coefficients.row(1) = 2.0 * request.start.v.transpose();
    plan.coefficients.row(2) = RandomVector(&random, 5.0, 5.0, 0.0).transpose();
    const std::optional<Stop> stop = WayOut(config, request, plan, true);
    const auto meets_movers = [&](double until, double radius) {
      for (int i = 0; i <= kInstants; ++i) {
        const double t = plan.start + until * i / kInstants;
        const auto meets = [&](const world::Obstacle& o) {
          return Distance(o, plan.Position(t), t) < radius;
        };
        if (request.target_body && meets(*request.target_body)) return true;
        for (const world::Obstacle& o : request.obstacles)
          if (o.moving && meets(o)) return true;
      }
      return false;
    };
    PlanRequest later = request;
    const auto is_free = [&](double after) {
      later.t0 = request.t0 + after;
      later.start = plan.At(later.t0);
      return !meets_movers(after, config.hard_radius() + kTouch) && Brake(hard, later).has_value();
    };
    constexpr int kWindow = 8;  // of 0.05 s
    int run = 0, longest = 0;
    for (int i = 0; i <= 22; ++i) {
      run = is_free(0.05 * i) ? run + 1 : 0;
      longest = std::max(longest, run);
    }
    EXPECT_TRUE(stop || longest <= kWindow) << seed;
    none += !stop;
    if (!stop) continue;
    const double after = stop->trajectory.start - plan.start;
    const bool is_late = after > kOverdue + 1e-9;
    EXPECT_FALSE(is_late && meets_movers(after, config.hard_radius() - kTouch)) << seed;
    EXPECT_TRUE(std::abs(after - kOverdue) < 1e-9 || !is_free(kOverdue)) << seed << " " << after;
    late += is_late && after < 1.2;
  }
  EXPECT_GT(late, 5);
  EXPECT_GT(none, 20);
}

// In the open a target of a person's height, which cannot be flown over, walks at the drone, or
// past it, and neither braking nor rising is certified at any time of the plan: it can be left
// aside, out of the reach of two deviations.
TEST(WayOut, StepsAsideFromATargetThatComes) {
  PlannerConfig config;
  config.z_max = 1.5;
  int needed = 0, found = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Random random(seed, 12);
    const auto level = [&](double length) -> Vector3d {
      const double angle = random.Uniform(-M_PI, M_PI);
      return length * Vector3d(std::cos(angle), std::sin(angle), 0.0);
    };
    PlanRequest request;
    request.start.p = {0.0, 0.0, 1.0};
    request.start.v = level(random.Uniform(0.0, 0.5));
    request.target_body.emplace();
    world::Obstacle& target = *request.target_body;
    target.id = kTargetId;
    target.moving = true;
    target.solid = world::Obstacle::Solid::kCylinder;
    target.half = {0.25, 0.25, 0.85};
    target.shape = target.half.cwiseAbs2().cwiseInverse().asDiagonal();
    const Vector3d from = level(random.Uniform(1.2, 1.6)) + Vector3d(0.0, 0.0, 0.85);
    const Vector3d to = level(0.3) + Vector3d(0.0, 0.0, 0.85);
    const double speed = random.Uniform(0.8, 1.3);
    target.center = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
    target.center.coefficients.row(0) = from.transpose();
    target.center.coefficients.row(1) = 2.5 * speed * (to - from).normalized().transpose();
    request.target_manoeuvre = world::kTargetManoeuvre;
    request.target = target.center;
    const Vector3d back = -1.5 * Vector3d(from.x(), from.y(), 0.0).normalized();
    const world::Trajectory plan{0.0, 2.5, CurveTo(request.start, 2.5, back + request.start.p)};
    bool needs = true;
    for (double t = 0.0; t <= plan.end() && needs; t += 0.1) {
      Resting resting(config, request);
      resting.KeepOff();
      resting.From(plan.At(t), t);
      needs = !resting.RiseOrBrake();
    }
    const std::optional<Stop> stop = WayOut(config, request, plan);
    needed += needs;
    if (!needs || !stop) continue;
    ++found;
    const world::Trajectory& way = stop->trajectory;
    EXPECT_LT(way.Velocity(way.end()).norm(), 1e-6) << seed;
    for (int i = 0; i <= kInstants; ++i) {
      const double t = way.start + way.duration * i / kInstants;
      const double reach = config.sigmas * std::sqrt(request.target_manoeuvre.Variance(t));
      EXPECT_GT(Distance(target, way.Position(t), t), config.hard_radius() + reach - 1e-6)
          << seed << " at " << t;
    }
  }
  EXPECT_GT(needed, 100);
  EXPECT_GT(found, 0.5 * needed) << "of " << needed;
}

// It knows no north: where everything is turned, so is the step.
TEST(WayOut, StepsAsideAlikeInAllDirections) {
  const PlannerConfig config;
  int found = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Random random(seed, 13);
    const double across = random.Uniform(-0.4, 0.4), speed = random.Uniform(0.0, 0.8);
    const world::Obstacle beside =
        RandomCylinder(&random, 1, {random.Uniform(-1.5, -1.0), random.Uniform(-1.5, 1.5), 1.0});
    const auto step = [&](double turn) -> std::optional<Vector3d> {
      const Eigen::Matrix3d R = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).matrix();
      PlanRequest request;
      request.start.p = {0.0, 0.0, 1.5};
      request.start.v = R * Vector3d(0.0, speed, 0.0);
      request.obstacles = {beside};
      request.target_body.emplace();
      for (world::Obstacle* o : {&request.obstacles[0], &*request.target_body}) {
        if (o->id != 1) {
          o->id = kTargetId;
          o->solid = world::Obstacle::Solid::kCylinder;
          o->half = {0.25, 0.25, 0.85};
          o->shape = o->half.cwiseAbs2().cwiseInverse().asDiagonal();
          o->center = world::Trajectory::Constant({1.1, across, 0.85}, 0.0, 5.0);
        }
        o->moving = false;
        o->center.coefficients = (o->center.coefficients.topRows(1) * R.transpose()).eval();
      }
      Resting resting(config, request);
      resting.From(request.start, 0.0);
      const std::optional<Stop> stop = resting.StepAside();
      if (!stop) return std::nullopt;
      return R.transpose() * stop->trajectory.Position(stop->trajectory.end());
    };
    const std::optional<Vector3d> north = step(0.0);
    found += north.has_value();
    for (const double turn : {0.7, 2.0, -2.4}) {
      const std::optional<Vector3d> turned = step(turn);
      ASSERT_EQ(turned.has_value(), north.has_value()) << seed;
      if (!north) continue;
      EXPECT_LT((*turned - *north).norm(), 1e-6) << seed << " " << turn;
    }
  }
  EXPECT_GT(found, 20);
}

// At the edge of what is listed straight away from the target is not looked into.
TEST(WayOut, StepsAsideNoFartherThanUnseenPlacesAreListed) {
  const PlannerConfig config;
  PlanRequest request;
  request.start.p = {0.0, 0.0, 1.5};
  request.target_body.emplace();
  world::Obstacle& target = *request.target_body;
  target.id = kTargetId;
  target.solid = world::Obstacle::Solid::kCylinder;
  target.half = {0.25, 0.25, 0.85};
  target.center = world::Trajectory::Constant({1.4, 0.0, 0.85}, 0.0, 2.5);
  world::State edge;
  edge.p = {world::kFlightVolume.unseen - 0.1, 0.0, 1.5};
  Resting resting(config, request);
  resting.From(edge, 0.0);
  const std::optional<Stop> stop = resting.StepAside();
  ASSERT_TRUE(stop);
  const Vector3d end = stop->trajectory.Position(stop->trajectory.end());
  EXPECT_GT((end - edge.p).norm(), 0.5);
  EXPECT_LE((end - request.start.p).norm(), world::kFlightVolume.unseen);
}

}  // namespace
}  // namespace chase::planning
