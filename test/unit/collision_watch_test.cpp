#include "deploy/flight/collision_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "common/bus/convert.h"
#include "common/world/flight_volume.h"

namespace chase::flight {
namespace {

using Eigen::Vector3d;
using world::Solid;

constexpr int64_t kStart = 1'700'000'000'000'000;  // of mission time, microseconds
constexpr double kStep = 0.01;                     // s of TRUTH
constexpr double kRadius = 0.25;                   // of the drone, m
constexpr double kTouchdown = 0.75;                // m/s: what is faster falls
constexpr double kGrain = 0.03;                    // m: how far apart the points of its sphere are

bool IsInside(const Solid& solid, const Vector3d& x) {
  const Vector3d d = Eigen::AngleAxisd(-solid.yaw, Vector3d::UnitZ()) * (x - solid.center);
  const Vector3d& h = solid.half_size;
  switch (solid.kind) {
    case Solid::Kind::kBox:
      return (d.cwiseAbs().array() <= h.array()).all();
    case Solid::Kind::kCylinder:
      return d.head<2>().norm() <= h.x() && std::abs(d.z()) <= h.z();
    case Solid::Kind::kEllipsoid:
      return d.cwiseQuotient(h).norm() <= 1.0;
  }
  return false;
}

/// Of a sphere about zero with radius 1, on Fibonacci's spiral.
std::vector<Vector3d> SpherePoints() {
  constexpr int kPoints = 1000;
  std::vector<Vector3d> points;
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kPoints, angle = i * M_PI * (3.0 - std::sqrt(5.0));
    points.emplace_back(std::sqrt(1.0 - z * z) * std::cos(angle),
                        std::sqrt(1.0 - z * z) * std::sin(angle), z);
  }
  return points;
}

/// Is any point of the sphere's surface in the solid?
bool Touches(const Vector3d& p, double radius, const Solid& solid) {
  static const std::vector<Vector3d> points = SpherePoints();
  if ((p - solid.center).norm() > radius + solid.half_size.norm()) return false;
  return std::any_of(points.begin(), points.end(),
                     [&](const Vector3d& x) { return IsInside(solid, p + radius * x); });
}

struct Moment {
  double t = 0.0;
  Vector3d p = {0, 0, 1.5}, v = Vector3d::Zero();
  Vector3d target = {40, 0, 0.5};
  int8_t state = flight_state_t::CHASE;
};

std::optional<double> Watched(const world::Scenario& scenario, const std::vector<Moment>& flight) {
  CollisionWatch watch(scenario);
  for (const Moment& moment : flight) {
    flight_state_t state{};
    state.state = moment.state;
    watch.Add(state);
    truth_t truth{};
    truth.utime = kStart + std::llround(1e6 * moment.t);
    truth.mission_time = moment.t;
    bus::Set(truth.pos, moment.p);
    bus::Set(truth.vel, moment.v);
    bus::Set(truth.target_pos, moment.target);
    truth.orientation[0] = 1.0;
    watch.Add(truth);
  }
  return watch.time();
}

/// The first moment at which a sphere of `radius` touches what counts then.
std::optional<double> Sampled(const world::Scenario& scenario, const std::vector<Moment>& flight,
                              double radius, const std::function<bool(const Moment&)>& ground,
                              const std::function<bool(const Moment&)>& over) {
  const std::vector<Solid> still = world::StaticSolids(scenario);
  for (const Moment& moment : flight) {
    if (moment.t < 0.0 || moment.t > scenario.duration_s || over(moment)) continue;
    std::vector<Solid> solids = still;
    for (const auto& mover : scenario.movers)
      solids.push_back(world::MoverAt(mover, moment.t).solid);
    solids.push_back(world::TargetSolid(scenario.target, moment.target, 0.0));
    const auto touches = [&](const Solid& solid) { return Touches(moment.p, radius, solid); };
    if ((ground(moment) && moment.p.z() <= radius) ||
        std::any_of(solids.begin(), solids.end(), touches))
      return moment.t;
  }
  return std::nullopt;
}

bool Never(const Moment&) { return false; }
bool Always(const Moment&) { return true; }

/// Not before a sphere that is larger by the grain touches, and not after the sphere itself does.
void ExpectBetween(const std::optional<double>& time, const std::optional<double>& first,
                   const std::optional<double>& last, unsigned seed) {
  if (time) {
    ASSERT_TRUE(first.has_value()) << seed << ": " << *time;
    EXPECT_GE(*time, *first - 1e-9) << seed;
  }
  if (last) {
    ASSERT_TRUE(time.has_value()) << seed << ": " << *last;
    EXPECT_LE(*time, *last + 1e-9) << seed;
  }
}

world::Scenario Hall() {
  world::Scenario scenario;
  scenario.duration_s = 8.0;
  scenario.chaser.radius = kRadius;
  return scenario;
}

/// A person who walks along x through `place` at time `t`.
world::MoverSpec Walker(const Vector3d& place, double t, double height) {
  world::MoverSpec walker;
  walker.shape = "cylinder";
  walker.size = {0.5, 0.5, height};
  const Vector3d at(place.x(), place.y(), 0.5 * height), way(20.0, 0.0, 0.0);
  walker.waypoints = {at - way, at + way};
  walker.times = {t - 16.0, t + 16.0};
  return walker;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution(low, high)(engine_);
  }
  Vector3d Place(double low) { return {(*this)(-5, 5), (*this)(-5, 5), (*this)(low, 3.0)}; }

 private:
  std::mt19937 engine_;
};

world::Scenario FurnishedHall(Random* random) {
  Random& draw = *random;
  world::Scenario scenario = Hall();
  for (int i = 0; i < 2; ++i) {
    const Vector3d p = draw.Place(0.0);
    scenario.world.cylinders.push_back({p.head<2>(), draw(0.2, 0.5), draw(1.0, 3.0), 0.0});
  }
  scenario.world.boxes.push_back({draw.Place(0.0), {0.8, 1.5, 1.0}, draw(0.0, 180.0)});
  scenario.world.ellipsoids.push_back({draw.Place(0.0), {0.4, 0.8, 0.5}, draw(0.0, 180.0)});
  scenario.movers = {Walker(draw.Place(0.0), draw(0.0, 8.0), 1.8)};
  return scenario;
}

/// From place to place, straight on; it begins 1 s before the mission.
std::vector<Moment> Wandering(Random* random) {
  Random& draw = *random;
  std::vector<Moment> flight;
  const double speed = draw(0.5, 2.0);
  Vector3d p = draw.Place(0.5), goal = p;
  for (int k = -100; k < 900; ++k) {
    if ((goal - p).norm() < speed * kStep) goal = draw.Place(-0.5);
    Moment& moment = flight.emplace_back();
    moment.v = speed * (goal - p).normalized();
    moment.t = k * kStep;
    moment.p = p += kStep * moment.v;
    moment.target = {-p.x(), 0.3, 0.25};
  }
  return flight;
}

TEST(CollisionWatch, TellsTheFirstContactInTheAirAsBruteForceDoes) {
  int touched = 0, by_ground = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const world::Scenario scenario = FurnishedHall(&random);
    const std::vector<Moment> flight = Wandering(&random);
    const std::optional<double> time = Watched(scenario, flight);
    const auto first = Sampled(scenario, flight, kRadius + kGrain, Always, Never);
    const auto last = Sampled(scenario, flight, kRadius, Always, Never);
    ExpectBetween(time, first, last, seed);
    touched += time.has_value();
    by_ground += last != Sampled(scenario, flight, kRadius, Never, Never);
  }
  EXPECT_GT(touched, 15);
  EXPECT_LT(touched, 55);
  EXPECT_GT(by_ground, 5);
}

/// Down at 0.5 m/s from 1.5 m, by itself or, where the motors are cut before, in a fall; at rest on
/// the ground. DONE from `done` on.
std::vector<Moment> Landing(const Vector3d& place, double done) {
  std::vector<Moment> flight;
  double z = 1.5, v = -0.5;
  for (int k = 0; k <= 800; ++k) {
    Moment& moment = flight.emplace_back();
    moment.t = k * kStep;
    moment.state = moment.t < done ? flight_state_t::LAND : flight_state_t::DONE;
    if (moment.t >= done) v -= 9.81 * kStep;
    z += kStep * v;
    if (z < 0.12) z = 0.12, v = 0.0;
    moment.p = {place.x(), place.y(), z};
    moment.v = {0.0, 0.0, v};
  }
  return flight;
}

TEST(CollisionWatch, WhatPassesADroneThatHasLandedIsNoneAndBeforeItIs) {
  int touched = 0, passed = 0;
  for (unsigned seed = 1; seed <= 80; ++seed) {
    Random draw(seed);
    world::Scenario scenario = Hall();
    const Vector3d place = draw.Place(0.0);
    const auto flight = Landing(place, draw(1.0, 6.0));
    scenario.movers = {Walker(place + Vector3d(0, draw(-0.8, 0.8), 0), draw(0.0, 8.0), 1.8)};
    bool lies = false;
    const auto over = [&lies](const Moment& m) {
      if (m.t == 0.0) lies = false;
      lies = lies || (m.state == flight_state_t::DONE && m.p.z() < world::kFlightVolume.low &&
                      m.v.norm() <= kTouchdown);
      return lies;
    };
    const std::optional<double> time = Watched(scenario, flight);
    const auto first = Sampled(scenario, flight, kRadius + kGrain, Never, over);
    const auto last = Sampled(scenario, flight, kRadius, Never, over);
    ExpectBetween(time, first, last, seed);
    touched += time.has_value();
    passed += !time && Sampled(scenario, flight, kRadius, Never, Never).has_value();
  }
  EXPECT_GT(touched, 10);
  EXPECT_GT(passed, 10);
}

TEST(CollisionWatch, TheGroundIsTouchedInTheAirAloneAndByAFallIntoTheTargetAsWell) {
  std::vector<Moment> flight = Landing({1, 1, 0}, 5.0);
  EXPECT_FALSE(Watched(Hall(), flight)) << "a landing";
  for (Moment& moment : flight) moment.state = flight_state_t::CHASE;
  ASSERT_TRUE(Watched(Hall(), flight));
  EXPECT_NEAR(*Watched(Hall(), flight), (1.5 - kRadius) / 0.5, 0.03) << "nobody asked for it";
  flight = Landing({1, 1, 0}, 0.5);
  for (Moment& moment : flight) moment.target = {1, 1, 0.5};
  EXPECT_TRUE(Watched(Hall(), flight)) << "its motors were cut above the target";
}

TEST(CollisionWatch, KeepsTheFirstAndLooksAtTheMissionAlone) {
  world::Scenario scenario = Hall();
  scenario.world.cylinders = {{{0, 0}, 0.3, 3.0, 0.0}};
  std::vector<Moment> flight;
  const auto inside = [](double t) { return t < -0.005 || (t > 1.995 && t < 3.0) || t > 4.995; };
  for (int k = -200; k <= 900; ++k) {
    Moment& moment = flight.emplace_back();
    moment.t = k * kStep;
    moment.p = {inside(moment.t) ? 0.2 : 3.0, 0.0, 1.5};
  }
  ASSERT_TRUE(Watched(scenario, flight));
  EXPECT_NEAR(*Watched(scenario, flight), 2.0, 1e-9);
  for (Moment& moment : flight)
    if (moment.t > 0.0 && moment.t < 8.005) moment.p.x() = 3.0;
  EXPECT_FALSE(Watched(scenario, flight));
}

}  // namespace
}  // namespace chase::flight
