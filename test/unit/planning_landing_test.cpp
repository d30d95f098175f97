// Where the pilot leads a body that is to land.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "test/unit/planning_flight.h"

namespace chase::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Flight;

constexpr double kWay = 0.15;  // m: what counts as there

/// A slab about the plane z = at + slope x over [x0, x1] and 20 m to both sides along y.
world::Obstacle Slab(int id, double x0, double x1, double at, double slope = 0.0) {
  world::Obstacle o;
  o.id = id;
  o.ground = true;
  o.solid = world::Obstacle::Solid::kBox;
  const double middle = 0.5 * (x0 + x1);
  o.center = world::Trajectory::Constant({middle, 0.0, at + slope * middle}, 0.0, 1.0);
  o.axes = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(-slope, 0.0, 1.0));
  const double stretch = std::hypot(1.0, slope);
  o.half = {0.5 * (x1 - x0) * stretch, 20.0, 0.3 / stretch};
  const Eigen::Matrix3d R = o.axes.toRotationMatrix();
  o.shape = R * (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal() * R.transpose();
  return o;
}

world::Obstacle Block(int id, const Vector3d& center, const Vector3d& half) {
  world::Obstacle o;
  o.id = id;
  o.solid = world::Obstacle::Solid::kBox;
  o.half = half;
  o.shape = (3.0 * half.cwiseAbs2()).cwiseInverse().asDiagonal();
  o.center = world::Trajectory::Constant(center, 0.0, 1.0);
  return o;
}

/// In the air at p, over this, and told to land; the takeoff was elsewhere.
Flight Landing(std::vector<world::Obstacle> world, const Vector3d& p = {0.0, 0.0, 1.5}) {
  Flight flight(p);
  flight.flying_before = true;
  flight.obstacles = std::move(world);
  flight.pilot.SetTask(Task::kHold, Vector3d(50.0, 0.0, 0.1));
  flight.Run(1.0);
  flight.pilot.SetTask(Task::kLand, Vector3d(50.0, 0.0, 0.1));
  flight.Run(9.0);
  return flight;
}

double Aside(const Flight& flight) { return flight.Body().p.head<2>().norm(); }

TEST(Landing, OnLevelGroundItStays) {
  const Flight flight = Landing({Slab(1, -20.0, 20.0, 0.0, 0.05)});
  EXPECT_LT(Aside(flight), kWay);
  EXPECT_EQ(flight.plans.back().verdict, Verdict::kWait);
  EXPECT_EQ(flight.plans.back().reason, "landing, on level ground");
}

TEST(Landing, FromASlopeItIsLedToTheNearestLevelGround) {
  const Flight flight =
      Landing({Slab(1, -20.0, 3.0, -0.9, 0.3), Slab(2, 3.0, 20.0, 0.0)}, {0.0, 0.0, 1.0});
  const Vector3d p = flight.Body().p;
  EXPECT_GT(p.x(), 3.0 + 0.49);
  EXPECT_LT(p.x(), 4.6);
  EXPECT_NEAR(p.z(), 1.9, 0.1) << "as high above the ground as before";
  EXPECT_LT(flight.Body().v.norm(), 0.02);
  for (const PlanResult& plan : flight.plans) EXPECT_GE(plan.certified_clearance, 0.0);
}

TEST(Landing, FromAboveAStepItIsLedAside) {
  const Flight flight = Landing({Slab(1, -20.0, 0.2, 0.0), Slab(2, 0.2, 20.0, 0.35)});
  EXPECT_GT(std::abs(flight.Body().p.x() - 0.2), 0.5);
  EXPECT_LT(Aside(flight), 1.6) << "and no farther than it must";
}

TEST(Landing, NotOnWhatStandsOnTheGroundNorOnTheTarget) {
  Flight flight = Landing({Slab(1, -20.0, 20.0, 0.0), Block(2, {0.3, 0.0, 0.3}, {0.5, 0.5, 0.3})});
  EXPECT_GT(Vector2d((flight.Body().p - Vector3d(0.3, 0.0, 0.0)).head<2>()).cwiseAbs().maxCoeff(),
            0.5 + 0.5);
  EXPECT_LT(Aside(flight), 2.0);
}

TEST(Landing, WhereNoGroundIsListedAFreePlaceHasToDo) {
  const Flight taken = Landing({Block(2, {0.0, 0.0, 0.3}, {0.5, 0.5, 0.3})});
  EXPECT_GT(taken.Body().p.head<2>().cwiseAbs().maxCoeff(), 1.0);
  const Flight free = Landing({});
  EXPECT_LT(Aside(free), kWay);
  EXPECT_EQ(free.plans.back().reason, "landing, no level ground is known: here");
}

TEST(Landing, OnASlopeWithoutEndItStaysAndSaysSo) {
  const Flight flight = Landing({Slab(1, -20.0, 20.0, 0.0, 0.4)});
  EXPECT_LT(Aside(flight), kWay);
  EXPECT_EQ(flight.plans.back().reason, "landing, no level ground is known: here");
}

TEST(Landing, WhereItTookOffTheGroundHasBorneIt) {
  Flight flight({0.0, 0.0, 1.5});
  flight.flying_before = true;
  flight.obstacles = {Slab(1, -20.0, 1.0, -0.3, 0.3), Slab(2, 1.0, 20.0, 0.0)};
  flight.pilot.SetTask(Task::kLand, Vector3d(0.1, 0.0, -0.2));
  flight.Run(6.0);
  EXPECT_LT(Aside(flight), kWay);
}

TEST(Landing, OnTheWayDownNothingLeadsAside) {
  Flight flight = Landing({Slab(1, -20.0, 20.0, 0.0)});
  flight.pilot.SetDescending(true);
  flight.obstacles = {Slab(1, -20.0, 3.0, -0.9, 0.3), Slab(2, 3.0, 20.0, 0.0)};
  flight.Run(4.0);
  EXPECT_LT(Aside(flight), kWay);
}

TEST(Landing, AWallBetweenIsNotFlownThrough) {
  const Flight flight = Landing({Slab(1, -20.0, 3.0, -0.9, 0.3), Slab(2, 3.0, 20.0, 0.0),
                                 Block(3, {2.0, 0.0, 2.0}, {0.1, 9.0, 4.0})},
                                {0.0, 0.0, 1.0});
  EXPECT_LT(flight.Body().p.x(), 2.0 - 0.3);
  EXPECT_EQ(flight.plans.back().reason, "landing, no level ground is known: here");
}

// Against a brute force over points of the disc and of the column.
TEST(Landing, FootingAgreesWithPoints) {
  const LandingNeeds needs{0.55, 0.18, 6.0};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  int level = 0, uneven = 0, taken = 0;
  for (int i = 0; i < 400; ++i) {
    const double edge = 2.0 * u(random), step = 0.3 * u(random), slope = 0.4 * u(random);
    const Vector3d block(2.0 * u(random), 2.0 * u(random), 0.5);
    const std::vector<world::Obstacle> world = {Slab(1, -20.0, edge, 0.0, slope),
                                                Slab(2, edge, 20.0, step, slope),
                                                Block(3, block, {0.4, 0.4, 0.5})};
    const auto height = [&](const Vector2d& at) {
      return slope * at.x() + (at.x() > edge ? step : 0.0);
    };
    double most = 0.0, off = 1e9;
    for (int k = 0; k < 3000; ++k) {
      const Vector2d at(needs.radius * u(random), needs.radius * u(random));
      if (at.norm() <= needs.radius)
        most = std::max(most, std::abs(height(at) - height(Vector2d::Zero())));
    }
    off = (block.head<2>().cwiseAbs().array() - 0.4).max(0.0).matrix().norm();
    const double rise = most / (needs.radius * needs.most_slope);
    const Footing found = FootingAt(world, needs, {0.0, 0.0, 1.5});
    if (off < needs.radius - 0.02) {
      EXPECT_EQ(found, Footing::kTaken) << i;
      ++taken;
    } else if (off < needs.radius + 0.02) {
      continue;
    } else if (rise > 1.5) {
      // A step that only a sliver of the disc is beyond lies between the places that are looked at.
      const bool sliver = std::abs(std::abs(edge) - needs.radius) < 0.1;
      EXPECT_TRUE(sliver || found == Footing::kUneven) << edge << ' ' << step << ' ' << slope;
      ++uneven;
    } else if (rise < 0.9) {
      EXPECT_EQ(found, Footing::kLevel) << i;
      ++level;
    }
  }
  EXPECT_GT(level, 30);
  EXPECT_GT(uneven, 30);
  EXPECT_GT(taken, 10);
}

}  // namespace
}  // namespace chase::planning
