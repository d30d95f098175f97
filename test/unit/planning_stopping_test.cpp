#include <gtest/gtest.h>

#include "services/planning/resting.h"
#include "test/unit/planning_ways.h"

// Ways to rest, against brakings written anew and judged by sampled distances.

namespace chase::planning {
namespace {

// Of brakings that take 0.6 to 3 s one is found that takes at most 1.4 times as long as the
// quickest, where they are free for that long; none where all touch or ask for too much.
TEST(Brake, FindsAQuickOneWhereThereIsOneAndNoneElse) {
  PlannerConfig c;
  constexpr double kStep = 0.02, kLonger = 1.4;
  int found = 0, none = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    c.max_acceleration = seed % 2 ? 6.0 : 2.0;  // slow brakings
    const PlanRequest request = RandomRequest(c, seed);
    double free_since = HUGE_VAL, quick = HUGE_VAL;
    bool any = false;
    for (double T = 0.6; T <= 3.0 + 1e-9 && quick == HUGE_VAL; T += kStep) {
      const double room = Room(c, request, Braking(request, T));
      any = any || room > -0.005;
      if (room <= 0.005)
        free_since = HUGE_VAL;
      else if (free_since == HUGE_VAL)
        free_since = T;
      if (T >= kLonger * free_since) quick = T;
    }
    const auto stop = Brake(c, request);
    if (quick < HUGE_VAL) {
      ASSERT_TRUE(stop) << seed;
      EXPECT_LE(stop->trajectory.duration, quick + kStep) << seed;
    }
    found += stop.has_value();
    none += !any;
    if (!stop) continue;
    EXPECT_TRUE(any) << seed;
    const world::Trajectory& way = stop->trajectory;
    const world::Trajectory same = Braking(request, way.duration);
    EXPECT_TRUE(way.start == request.t0 && stop->certified);
    EXPECT_LT((way.Position(way.end()) - same.Position(way.end())).norm(), 1e-9) << seed;
    EXPECT_LT((way.Velocity(way.start + 0.3) - same.Velocity(way.start + 0.3)).norm(), 1e-9);
    EXPECT_GE(Room(c, request, way), -1e-6) << seed;
    EXPECT_EQ(stop->proofs.size(), request.obstacles.size());
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(none, 20);
}

// What refused one braking is asked about the next before all else: that refuses none that is free.
TEST(Brake, IsTheFirstThatIsCertifiedWithoutTheOthers) {
  const PlannerConfig c;
  int later = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    const PlanRequest request = RandomRequest(c, seed);
    std::optional<Stop> first;
    int refused = 0;
    for (const double T : kBrakeTimes) {
      first = Resting(c, request).Certified(BrakeCurve(request.start, T), T);
      if (first) break;
      ++refused;
    }
    const auto stop = Resting(c, request).BrakeWithin(false);
    ASSERT_EQ(stop.has_value(), first.has_value()) << seed;
    if (!stop) continue;
    EXPECT_EQ(stop->trajectory.duration, first->trajectory.duration) << seed;
    later += refused > 1;
  }
  EXPECT_GT(later, 20);
}

PlanRequest AtRest(PlanRequest request) {
  request.start.v = request.start.a = request.start.j = Vector3d::Zero();
  return request;
}

// What leads to a place is certified, leads there and rests there.
TEST(GoTo, LeadsToThePlaceWhereTheWayIsFree) {
  const PlannerConfig c;
  int found = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    PlanRequest request = RandomRequest(c, seed);
    request.start.v *= 0.2;
    request.start.a.setZero();
    Random random(seed, 6);
    const Vector3d end = request.start.p + RandomVector(&random, 4.0, 4.0, 0.2);
    const auto way = GoTo(c, request, end);
    request.obstacles.clear();
    ASSERT_TRUE(GoTo(c, request, end)) << seed;
    // At a metre a second where nothing is in the way, and in no less than 1.5 s.
    const auto quick = GoTo(c, AtRest(request), end);
    EXPECT_NEAR(quick->trajectory.duration, std::max(1.5, (end - request.start.p).norm()), 1e-9);
    if (!way) continue;
    ++found;
    request = RandomRequest(c, seed);
    EXPECT_GE(Room(c, request, way->trajectory), -1e-6) << seed;
    EXPECT_LT((way->trajectory.Position(way->trajectory.end()) - end).norm(), 1e-9) << seed;
    EXPECT_TRUE(world::EndsAtRest(way->trajectory)) << seed;
    // Its rest is as certified, later on.
    request.t0 += 0.4;
    request.start = way->trajectory.At(request.t0);
    const auto rest = GoOn(c, request, way->trajectory);
    ASSERT_TRUE(rest) << seed;
    EXPECT_NEAR(rest->trajectory.end(), way->trajectory.end(), 1e-9);
    EXPECT_LT(
        (rest->trajectory.Position(request.t0 + 0.5) - way->trajectory.Position(request.t0 + 0.5))
            .norm(),
        1e-9);
  }
  EXPECT_GT(found, 60);
}

/// When a way first touches, s after its start; infinite where it never does.
double FirstContact(const PlannerConfig& c, const PlanRequest& request,
                    const world::Trajectory& way) {
  for (double t = way.start; t <= way.end(); t += 0.005)
    for (const world::Obstacle& o : request.obstacles)
      if (Distance(o, way.Position(t), t) < c.drone_radius) return t - way.start;
  return HUGE_VAL;
}

// A plan that was certified with its stop is flown on where nothing else can be certified from
// where the body is by now: until that stop begins, and along it.
TEST(Rest, GoesOnWithTheStopThatWasCommittedTo) {
  const PlannerConfig config;
  PlannerConfig hard = config;
  hard.safety_margin = 0.0;
  int before = 0, along = 0;
  for (unsigned seed = 1; seed <= 3000; ++seed) {
    PlanRequest request = RandomRequest(config, seed);
    const world::Trajectory plan = Braking(request, 2.2);
    const std::optional<Stop> stop = WayOut(config, request, plan, true);
    if (!stop) continue;
    const world::Trajectory& way = stop->trajectory;
    request.running = plan;
    request.stop = way;
    for (const double t : {0.5 * (plan.start + way.start), way.start + 0.4 * way.duration}) {
      request.t0 = t;
      request.start = t < way.start ? plan.At(t) : way.At(t);
      if (Brake(config, request) || Brake(hard, request)) continue;
      const PlanResult rest = RestPlan(config, request);
      const bool holds = rest.reason == (t < way.start ? "the running plan until its stop"
                                                       : "on the stop of the plan before");
      if (!holds) {
        EXPECT_FALSE(GoOn(hard, request, t < way.start ? plan : way)) << seed;
        continue;
      }
      ++(t < way.start ? before : along);
      EXPECT_TRUE(rest.verdict == Verdict::kEscape ||
                  rest.verdict == (t < way.start ? Verdict::kSafeOnly : Verdict::kBrake))
          << rest.reason;
      EXPECT_GE(rest.certified_clearance, 0.0);
      EXPECT_EQ(world::Refute(ClaimOf(rest, request.target, config),
                              {config.hard_radius(), config.sigmas}, request.obstacles),
                "")
          << seed;
      const world::Trajectory& last = t < way.start ? *rest.stop : rest.trajectory;
      EXPECT_LT((last.Position(last.end()) - way.Position(way.end())).norm(), 1e-6);
      for (double at = t; at < way.end(); at += 0.02) {
        const bool stops = rest.stop && at >= rest.stop->start;
        const Vector3d p = stops ? rest.stop->Position(at) : rest.trajectory.Position(at);
        for (const auto& o : request.obstacles)
          EXPECT_GT(Distance(o, p, at), config.hard_radius() - 1e-6) << seed << " " << at;
      }
    }
  }
  EXPECT_GT(before, 0);
  EXPECT_GT(along, 0);
  std::printf("%d before a stop, %d along it\n", before, along);
}

// Who comes to where braking leads within two seconds is got out of the way of; who comes later is
// planned for later.
TEST(Rest, MindsWhoComesSoon) {
  for (const auto& [comes_after, verdict] :
       {std::pair{1.9, Verdict::kEscape}, std::pair{5.0, Verdict::kBrake}}) {
    PlanRequest request;
    request.t0 = 10.0;
    request.start.p = {0.0, 0.0, 1.2};
    request.start.v = {0.2, 0.0, 0.0};
    request.target = world::Trajectory::Constant({0.0, 0.0, 50.0}, request.t0, 5.0);
    Random random(1, 7);
    world::Obstacle walker = RandomCylinder(&random, 4, Vector3d::Zero());
    walker.moving = true;
    walker.half = {0.3, 0.3, 1.0};
    walker.shape = (2.0 * walker.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    walker.center = {request.t0, 1.0, Eigen::MatrixXd::Zero(2, 3)};
    walker.center.coefficients.row(0) << 0.0, 1.2 * comes_after, 1.0;
    walker.center.coefficients.row(1) << 0.0, -1.2, 0.0;
    request.obstacles = {walker};
    EXPECT_EQ(RestPlan(PlannerConfig(), request).verdict, verdict) << comes_after;
  }
}

// The plan that only slows down is called so; the one that must be faster first, until its
// acceleration is taken back, is not.
TEST(Rest, BrakesOnlyWhereItSlowsDown) {
  const PlannerConfig c;
  int brakes = 0, faster = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    const PlanRequest request = RandomRequest(c, seed);
    const PlanResult plan = RestPlan(c, request);
    double top = 0.0;
    const world::Trajectory& way = plan.trajectory;
    for (int i = 0; i <= kInstants; ++i)
      top = std::max(top, way.Velocity(way.start + way.duration * i / kInstants).norm());
    const double gain = top - request.start.v.norm();
    const bool brake = plan.verdict == Verdict::kBrake;
    EXPECT_TRUE(!brake || gain < 0.051) << seed;
    brakes += brake;
    if (plan.reason.find("faster at first") == std::string::npos) continue;
    EXPECT_GT(gain, 0.05) << seed;
    EXPECT_EQ(plan.verdict, plan.certified_clearance < 0.0 ? Verdict::kMitigate : Verdict::kEscape)
        << seed;
    ++faster;
  }
  EXPECT_GT(brakes, 100);
  EXPECT_GT(faster, 10);
}

// A quartic that ends at rest before a wall says nothing of what comes after.
TEST(Brake, CountsOnNoForecastBeyondItsEnd) {
  PlannerConfig config;
  config.z_min = config.z_max = 0.0;
  PlanRequest request;
  request.start.p = {0.0, 0.0, 1.0};
  request.start.v = {1.0, 0.0, 0.0};
  request.target = world::Trajectory::Constant({0.0, 0.0, 50.0}, 0.0, 5.0);
  world::Obstacle walker;
  walker.solid = world::Obstacle::Solid::kCylinder;
  walker.half = {0.25, 0.25, 0.9};
  walker.shape = (2.0 * walker.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  walker.moving = true;
  walker.center = {0.0, 0.1, Eigen::MatrixXd::Zero(5, 3)};
  for (const double away : {1.5, 4.0}) {
    walker.center.coefficients.row(0) << 0.0, away, 0.9;
    request.obstacles = {walker};
    EXPECT_EQ(Brake(config, request).has_value(), away > 2.0) << away;
  }
  walker.center.duration = 3.0;
  walker.center.coefficients.row(0) << 0.0, 1.5, 0.9;
  request.obstacles = {walker};
  EXPECT_TRUE(Brake(config, request)) << "forecast for as long as it takes";
  request.obstacles.clear();
  for (const double lasts : {0.1, 3.0}) {
    walker.center.duration = lasts;
    request.target_body = walker;
    EXPECT_EQ(Brake(config, request).has_value(), lasts > 1.0) << "the target";
  }
}

// With whatever is struck first: what stands, what walks, the target, the ground.
TEST(Harm, IsTheFirstContactAndTheLeastDistance) {
  const PlannerConfig c;
  constexpr double T = 1.7, kStep = 0.05, kFar = 0.2;  // s, m: samples, and between them
  int with_target = 0, with_ground = 0, with_others = 0, none = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    PlanRequest request = RandomRequest(c, seed);
    if (seed % 3 == 0) request.start.v.z() = -2.0;
    Random random(seed, 9);
    const world::Obstacle body =
        RandomCylinder(&random, kTargetId, RandomVector(&random, 2.0, 2.0, 0.5) + request.start.p);
    if (Distance(body, request.start.p, request.t0) > c.hard_radius()) request.target_body = body;
    Resting resting(c, request);
    world::State inside = request.start;  // where harm is something else, before
    inside.p = request.obstacles[0].center.Position(request.t0);
    resting.From(inside, request.t0);
    resting.Harm(BrakeCurve(inside, T), T);
    resting.From(request.start, request.t0);
    const auto [contact, least] = resting.Harm(BrakeCurve(request.start, T), T);
    const world::Trajectory way = Braking(request, T);
    double first = HUGE_VAL, deep = HUGE_VAL, nearest = HUGE_VAL;
    int by = 3;
    for (double t = way.start; t <= way.end(); t += 0.01) {
      const Vector3d p = way.Position(t);
      double distance[] = {HUGE_VAL, p.z(), HUGE_VAL};
      if (request.target_body) distance[0] = Distance(body, p, t);
      for (const world::Obstacle& o : request.obstacles)
        distance[2] = std::min(distance[2], Distance(o, p, t));
      const double* d = std::min_element(distance, distance + 3);
      if (*d < nearest) by = static_cast<int>(d - distance);
      nearest = std::min(nearest, *d);
      if (*d < c.drone_radius) first = std::min(first, t - way.start);
      if (*d < c.drone_radius - kFar) deep = std::min(deep, t - way.start);
    }
    EXPECT_NEAR(least, nearest, kFar) << seed;
    EXPECT_GE(contact, std::min(first - kStep, 1e9)) << seed;
    EXPECT_TRUE(contact <= deep + kStep) << seed;
    ++(first == HUGE_VAL ? none : by == 0 ? with_target : by == 1 ? with_ground : with_others);
  }
  for (const int n : {with_target, with_ground, with_others, none}) EXPECT_GT(n, 10);
}

// Walkers close in from all sides: what is flown touches no earlier than any braking within the
// limits would.
TEST(Evade, TouchesNoEarlierThanABraking) {
  const PlannerConfig c;
  int weighed = 0, later = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Random random(seed, 7);
    PlanRequest request = RandomRequest(c, seed);
    request.start.v *= 0.5;
    request.obstacles.clear();
    const PlanRequest alone = request;
    const double speed = random.Uniform(2.6, 3.5);
    for (int i = 0; i < 10; ++i) {
      const double angle = 2.0 * M_PI * (i + random.Uniform(-0.1, 0.1)) / 10.0;
      const Vector3d away(std::cos(angle), std::sin(angle), 0.0);
      world::Obstacle o = RandomCylinder(&random, i, 2.2 * away + Vector3d(0.0, 0.0, 1.5));
      o.half = {0.5, 0.5, 4.0};
      if (seed % 3 == 0) {
        o.solid = world::Obstacle::Solid::kEllipsoid;
        o.half.z() = 0.5;
        o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
      }
      o.center.start = request.t0;
      o.center.coefficients = Eigen::MatrixXd::Zero(2, 3);
      o.center.coefficients << 2.2 * away.transpose(), -speed * away.transpose();
      o.center.coefficients(0, 2) = 1.5;
      o.moving = true;
      request.obstacles.push_back(o);
    }
    const PlanRequest walkers = request;
    // What stands where the body is, and is left by going on, is not there.
    world::Obstacle around = RandomCylinder(&random, 100, Vector3d::Zero());
    around.moving = false;
    around.half = {0.8, 0.8, 4.0};
    around.center = world::Trajectory::Constant(
        request.start.p - 0.4 * request.start.v.normalized(), request.t0, 1.0);
    if (seed % 4 == 1) request.obstacles.push_back(around);
    const Stop stop = Evade(c, request);
    if (stop.certified) continue;
    ++weighed;
    const double contact = FirstContact(c, walkers, stop.trajectory);
    double best = 0.0;
    for (const double T : {0.6, 1.0, 1.7}) {
      const world::Trajectory way = Braking(request, T);
      if (Room(c, alone, way) > 0.01) best = std::max(best, FirstContact(c, walkers, way));
    }
    EXPECT_GE(contact, best - 0.03) << seed;
    EXPECT_GE(Room(c, alone, stop.trajectory), -1e-6) << seed;
    later += contact > best + 0.05;
  }
  EXPECT_GT(weighed, 10);
  EXPECT_GT(later, 0);
}

}  // namespace
}  // namespace chase::planning
