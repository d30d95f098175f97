#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "common/world/random.h"
#include "common/world/scenario.h"

namespace chase::world {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const std::string kGood = R"(name: small
target:
  waypoints:
    - [0, 0]
    - [5, 0]
)";

/// The error of a text that must be refused.
std::string Refusal(const std::string& yaml) {
  try {
    ParseScenario(yaml, "s.yaml");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "accepted";
}

#define EXPECT_CONTAINS(text, part) \
  EXPECT_NE((text).find(part), std::string::npos) << "'" << (text) << "' lacks '" << (part) << "'"

TEST(ScenarioFile, SmallestFileIsAccepted) {
  const Scenario scenario = ParseScenario(kGood, "s.yaml");
  EXPECT_EQ(scenario.name, "small");
  EXPECT_EQ(scenario.target.waypoints.size(), 2u);
  EXPECT_TRUE(scenario.Problem().empty());
}

TEST(ScenarioFile, UnknownKeyNamesItsLine) {
  const std::string error = Refusal(kGood + "  spede: 2\n");
  EXPECT_CONTAINS(error, "s.yaml:6");
  EXPECT_CONTAINS(error, "spede");
  EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST(ScenarioFile, BadSpeedIsRefused) {
  const std::string error = Refusal(kGood + "  speed: -1\n");
  EXPECT_CONTAINS(error, "speed is -1");
  EXPECT_CONTAINS(error, "s.yaml:6");
  EXPECT_CONTAINS(Refusal(kGood + "  speed: fast\n"), "s.yaml:6");
  EXPECT_CONTAINS(Refusal(kGood + "  speed: .nan\n"), "speed");
}

TEST(ScenarioFile, EveryPartIsChecked) {
  EXPECT_CONTAINS(Refusal("target: {waypoints: [[0, 0], [1, 0]]}\n"), "name");
  EXPECT_CONTAINS(Refusal("name: x\n"), "target.waypoints");
  EXPECT_CONTAINS(Refusal(kGood + "services: [{name: planing, config: \"\"}]\n"), "planing");
  EXPECT_CONTAINS(Refusal(kGood + "sensors: {mode: magic}\n"), "'magic'");
  EXPECT_CONTAINS(Refusal(kGood + "world: {cylinders: [{center: [1, 1], radius: 0}]}\n"),
                  "radius is 0");
  EXPECT_CONTAINS(Refusal(kGood + "world: {walls: [{from: [1, 1], to: [1, 1]}]}\n"), "from");
  EXPECT_CONTAINS(Refusal(kGood + "movers: [{shape: cone, waypoints: [[0, 0, 1]]}]\n"), "'cone'");
  EXPECT_CONTAINS(Refusal(kGood + "movers: [{shape: box}]\n"), "waypoints");
  EXPECT_CONTAINS(Refusal(kGood + "duration_s: 0\n"), "duration_s");
  EXPECT_CONTAINS(Refusal(kGood + "wind: {gust_time: 0}\n"), "gust_time");
  EXPECT_CONTAINS(Refusal(kGood + "chaser: {start: [1, 2]}\n"), "3 numbers");
}

TEST(ScenarioFile, FaultsAreChecked) {
  const auto with = [](const std::string& entry) { return kGood + "faults:\n  - " + entry + "\n"; };
  const Scenario scenario = ParseScenario(with("{name: freeze-control, at: 12, for: 3}"), "s.yaml");
  ASSERT_EQ(scenario.faults.size(), 1u);
  EXPECT_EQ(scenario.faults[0].at, 12.0);
  EXPECT_EQ(scenario.faults[0].duration, 3.0);
  const std::string error = Refusal(with("{name: kill-planing}"));
  EXPECT_CONTAINS(error, "s.yaml:7");
  EXPECT_CONTAINS(error, "name is 'kill-planing'");
  EXPECT_CONTAINS(error, "kill-planning");
  EXPECT_CONTAINS(Refusal(with("{name: kill-simulator}")), "'kill-simulator'");
  EXPECT_CONTAINS(Refusal(with("{name: kill-planning, at: 60}")), "s.yaml:7: faults[0]: at is 60");
  EXPECT_EQ(ParseScenario(with("{name: kill-planning, at: -8}"), "s.yaml").faults[0].at, -8.0);
  EXPECT_CONTAINS(Refusal(with("{name: kill-planning, at: -8.1}")),
                  "at is -8.1; it must be from -settle_s, -8");
  EXPECT_CONTAINS(Refusal(with("{name: kill-planning, at: .nan}")), "at is .nan");
  EXPECT_CONTAINS(Refusal(with("{name: kill-planning, for: 0}")), "for is 0");
  EXPECT_CONTAINS(Refusal(with("{name: kill-planning, for: .inf}")), "for is .inf");
  EXPECT_CONTAINS(Refusal(with("{name: lidar-dead, for: 3}")), "leave the key out");
  EXPECT_CONTAINS(Refusal(with("{name: lidar-dead, for: .nan}")), "for is .nan");
}

TEST(ScenarioFile, CommandsAreChecked) {
  const std::string head = "name: x\ntarget: {waypoints: [[0, 0], [1, 0]]}\nduration_s: 20\n";
  const auto problem = [&](const std::string& commands) -> std::string {
    try {
      ParseScenario(head + "commands: " + commands + "\n", "x.yaml");
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(problem("[{command: takeoff, at_s: -5}, {command: land, at_s: 3}]"), "");
  EXPECT_NE(problem("[{command: fly, at_s: 0}]").find("command is 'fly'"), std::string::npos);
  EXPECT_NE(problem("[{command: land, at_s: 20}]").find("at_s is 20"), std::string::npos);
  EXPECT_NE(problem("[{command: land, at_s: -9}]").find("at_s is -9"), std::string::npos);
  EXPECT_NE(problem("[{command: hold, at_s: 5}, {command: land, at_s: 4}]").find("commands[1]"),
            std::string::npos);
}

TEST(Fault, TextIsNameAndTime) {
  EXPECT_EQ(ParseFault("lidar-gap").name, "lidar-gap");
  EXPECT_EQ(ParseFault("lidar-gap").at, FaultSpec::kDrawn);
  EXPECT_EQ(ParseFault("kill-planning@-2").at, -2.0);
  EXPECT_EQ(ParseFault("kill-planning@12.5").at, 12.5);
  for (const char* text : {"", "kill-", "kill-planning@", "kill-planning@x", "kill-planning@-inf",
                           "kill-planning@1s", "kill-planning@nan", "kill-planning@inf", "@3"})
    EXPECT_THROW(ParseFault(text), std::runtime_error) << text;
}

TEST(Fault, EveryKindCanBeSettledAndLoadedAgain) {
  for (const FaultKind& kind : FaultKinds()) {
    const FaultSpec settled = Settled({kind.name}, 60.0, 1, 0);
    EXPECT_EQ(settled.duration, kind.duration);
    EXPECT_EQ(settled.Problem(), "");
    EXPECT_EQ(&KindOf(settled), &kind) << "two rows named " << kind.name;
  }
}

TEST(Fault, EveryPromisedNameIsThere) {
  for (const char* name :
       {"kill-mission",    "freeze-mission", "lidar-gap",      "lidar-dead", "camera-blackout",
        "camera-blur",     "exposure-jump",  "imu-spikes",     "imu-bias",   "delay-LIDAR_SCAN",
        "delay-PLAN",      "delay-UNSEEN",   "delay-TRACKING", "loss-5",     "loss-20",
        "clock-forward",   "clock-back",     "gust",           "motor-80",   "hidden-4s",
        "hidden-for-good", "decoy",          "flood",          "cpu-load",   "disk-full"})
    EXPECT_EQ(ParseFault(name).name, name);
}

TEST(Fault, WhatStrikesNothingSaysWhyAndTheCure) {
  const auto misfit = [](const char* name, bool sensors) {
    return Misfit(KindOf({name}), sensors);
  };
  EXPECT_CONTAINS(misfit("decoy", false), "--sensors raw");
  EXPECT_EQ(misfit("decoy", true), "");
  EXPECT_EQ(misfit("kill-mission", false), "");
  EXPECT_EQ(misfit("gust", false), "");
  EXPECT_CONTAINS(misfit("disk-full", true), "fly live");
}

TEST(Fault, TimesAreDrawnFromSeedNameAndNumber) {
  std::set<double> times;
  double sum = 0.0;
  int alike = 0;
  for (int64_t seed = 1; seed <= 500; ++seed)
    for (int number = 0; number < 2; ++number) {
      const FaultSpec fault = Settled({"kill-planning"}, 100.0, seed, number);
      EXPECT_EQ(fault.at, Settled({"kill-planning"}, 100.0, seed, number).at) << "seed " << seed;
      alike += fault.at == Settled({"lidar-gap"}, 100.0, seed, number).at;
      EXPECT_GE(fault.at, 20.0);
      EXPECT_LE(fault.at, 70.0);
      EXPECT_EQ(ParseFault("kill-planning@" + std::to_string(fault.at)).at, fault.at);
      times.insert(fault.at);
      sum += fault.at / 1000.0;
    }
  EXPECT_LT(alike, 5);
  EXPECT_GT(times.size(), 850u) << "of 1000 draws in steps of 0.01 s";
  EXPECT_NEAR(sum, 45.0, 3.0 * 50.0 / std::sqrt(12.0 * 1000.0));
  EXPECT_EQ(Settled({"kill-planning", 7.0}, 100.0, 3, 0).at, 7.0);
  EXPECT_EQ(Settled({"kill-planning", -2.0}, 100.0, 3, 0).at, -2.0) << "before the target moves";
}

TEST(ScenarioFile, MotionsThatMakeNoSenseAreRefused) {
  EXPECT_CONTAINS(Refusal(kGood + "  stops: [{waypoint: 2}]\n"), "stops is at a waypoint beyond");
  EXPECT_CONTAINS(Refusal(kGood + "  stops: [{waypoint: 1, duration: -1}]\n"), "duration is -1");
  EXPECT_CONTAINS(Refusal(kGood + "  shape: cone\n"), "'cone'");
  EXPECT_CONTAINS(Refusal(kGood + "  shape: sphere\n"), "twice the radius");
  EXPECT_CONTAINS(Refusal(kGood + "world: {ground: {slope: [2, 0]}}\n"), "slope is 2");
  const std::string mover = "movers: [{waypoints: [[0, 0, 1], [1, 0, 1]], times: ";
  EXPECT_CONTAINS(Refusal(kGood + mover + "[1]}]\n"), "times is 1 numbers");
  EXPECT_CONTAINS(Refusal(kGood + mover + "[1, 1]}]\n"), "times is out of order");
}

TEST(ScenarioFile, NothingIsGivenTwice) {
  EXPECT_CONTAINS(Refusal(kGood + "duration_s: 9\nname: other\n"),
                  "s.yaml:7: 'name' is given twice");
  const std::string entry = "  - {name: planning, config: \"horizon: 2.5\"}\n";
  const std::string error = Refusal(kGood + "services:\n" + entry + entry);
  EXPECT_CONTAINS(error, "s.yaml:8");
  EXPECT_CONTAINS(error, "'planning' a second time");
}

TEST(ScenarioFile, MissingFileIsNamed) {
  try {
    LoadScenario("/nowhere/at_all.yaml");
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_CONTAINS(std::string(e.what()), "/nowhere/at_all.yaml");
  }
}

TEST(ScenarioFile, OverridesOfAServiceAreFound) {
  const Scenario scenario =
      ParseScenario(kGood + "services: [{name: planning, config: \"horizon: 2.5\"}]\n", "s.yaml");
  EXPECT_EQ(ServiceConfig(scenario, "planning"), "horizon: 2.5");
  EXPECT_EQ(ServiceConfig(scenario, "mapping"), "");
}

TEST(ScenarioFile, PathFileIsReadRelativeToTheScenario) {
  const std::string folder = ::testing::TempDir();
  std::ofstream(folder + "/path.csv") << "t,x,y\n0,0,0\n1,1,0\n2,2,1\n";
  std::ofstream(folder + "/path.yaml") << "name: csv\ntarget: {path_file: path.csv}\n";
  const PathMotion path = TargetMotion(LoadScenario(folder + "/path.yaml"));
  EXPECT_NEAR((path.Position(1.0) - Vector2d(1.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.Position(9.0) - Vector2d(2.0, 1.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.Velocity(1.0) - Vector2d(1.0, 0.5)).norm(), 0.0, 1e-12);
  std::ofstream(folder + "/path.csv") << "0,0,0\n0,1,0\n";
  EXPECT_THROW(TargetMotion(LoadScenario(folder + "/path.yaml")), std::runtime_error);
}

/// Random walks of legs, as a driver might lay them.
std::vector<Vector2d> RandomWaypoints(Random* random) {
  std::vector<Vector2d> points = {Vector2d::Zero()};
  double angle = 0.0;
  for (int i = 0; i < 8; ++i) {
    angle += random->Uniform(-2.0, 2.0);
    const double length = random->Uniform(2.0, 6.0);
    points.push_back(points.back() + length * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return points;
}

TEST(Path, KeepsItsLimitsAndItsVelocityIsItsDerivative) {
  Random random(5);
  for (int n = 0; n < 20; ++n) {
    const auto points = RandomWaypoints(&random);
    const double speed = random.Uniform(0.5, 3.0), acceleration = random.Uniform(0.3, 1.5);
    const PathMotion path(points, speed, acceleration, 0.8);
    EXPECT_EQ(path.Position(-1.0), points.front());
    EXPECT_NEAR((path.Position(path.Duration() + 1.0) - points.back()).norm(), 0.0, 1e-6);
    for (double t = 0.01; t < path.Duration(); t += 0.0173) {
      EXPECT_LE(path.Velocity(t).norm(), 1.02 * speed);
      const Vector2d slope = (path.Position(t + 1e-5) - path.Position(t - 1e-5)) / 2e-5;
      EXPECT_NEAR((slope - path.Velocity(t)).norm(), 0.0, 1e-3 + 0.02 * speed);
    }
  }
}

TEST(Path, SpeedIsTrapezoidalOnAStraightLeg) {
  const PathMotion path({{0.0, 0.0}, {10.0, 0.0}}, 1.0, 0.5, 0.8);
  EXPECT_NEAR(path.Duration(), 12.0, 1e-9);
  EXPECT_NEAR(path.Position(1.0).x(), 0.25, 1e-9);
  EXPECT_NEAR(path.Velocity(1.0).x(), 0.5, 1e-9);
  EXPECT_NEAR(path.Position(6.0).x(), 5.0, 1e-9);
  EXPECT_NEAR(path.Velocity(6.0).x(), 1.0, 1e-9);
  EXPECT_NEAR(path.Position(11.0).x(), 9.75, 1e-9);
}

TEST(Path, CornersAreRoundedToTheRadius) {
  const PathMotion path({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}}, 1.0, 10.0, 2.0);
  const Vector2d center(8.0, 2.0);
  int on_arc = 0;
  for (double t = 0.0; t < path.Duration(); t += 0.01) {
    const Vector2d p = path.Position(t);
    if (p.x() < 8.0 || p.y() > 2.0) continue;
    ++on_arc;
    EXPECT_NEAR((p - center).norm(), 2.0, 1e-3);
  }
  EXPECT_GT(on_arc, 200);
}

TEST(Path, SlowsDownInCornersAndStops) {
  Random random(7);
  for (int n = 0; n < 20; ++n) {
    SCOPED_TRACE("draw " + std::to_string(n) + " of seed 7");
    const auto points = RandomWaypoints(&random);
    const PathLimits limits{random.Uniform(0.5, 3.0), random.Uniform(0.3, 1.5), 1.0};
    const double rest = random.Uniform(0.0, 3.0);
    const PathMotion path(points, limits, 0.5, {{0, 1.5}, {4, rest}});
    EXPECT_EQ(path.Position(1.5), points.front());
    EXPECT_NE(path.Position(1.7), points.front());
    EXPECT_GT(path.Direction(0.0).dot((points[1] - points[0]).normalized()), 0.999);
    double rested = 0.0;
    for (double t = 0.0; t < path.Duration() - 0.02; t += 0.01) {
      EXPECT_LE(path.Velocity(t).norm(), 1.02 * limits.speed);
      const Vector2d a = (path.Velocity(t + 0.02) - path.Velocity(t)) / 0.02;
      EXPECT_LE(a.norm(), 1.1 * std::hypot(limits.acceleration, limits.lateral) + 0.05) << t;
      if (path.Velocity(t).norm() < 1e-6 && (path.Position(t) - points[4]).norm() < 1e-6)
        rested += 0.01;
    }
    EXPECT_NEAR(rested, rest, 0.05);
  }
}

TEST(Path, OneWaypointStandsStill) {
  const PathMotion path({{1.0, 2.0}}, 1.0, 0.5, 0.8);
  EXPECT_EQ(path.Position(3.0), Vector2d(1.0, 2.0));
  EXPECT_EQ(path.Velocity(3.0), Vector2d(0.0, 0.0));
}

TEST(Mover, WaitsRunsAndStops) {
  MoverSpec mover;
  mover.waypoints = {{0.0, 0.0, 1.0}, {4.0, 0.0, 1.0}, {4.0, 4.0, 1.0}};
  mover.speed = 2.0;
  mover.start_time = 1.0;
  EXPECT_EQ(MoverAt(mover, 0.5).solid.center, Vector3d(0.0, 0.0, 1.0));
  EXPECT_EQ(MoverAt(mover, 0.5).velocity, Vector3d(0.0, 0.0, 0.0));
  EXPECT_EQ(MoverAt(mover, 2.0).solid.center, Vector3d(2.0, 0.0, 1.0));
  EXPECT_EQ(MoverAt(mover, 4.0).velocity, Vector3d(0.0, 2.0, 0.0));
  EXPECT_EQ(MoverAt(mover, 9.0).solid.center, Vector3d(4.0, 4.0, 1.0));
  EXPECT_EQ(MoverAt(mover, 9.0).velocity, Vector3d(0.0, 0.0, 0.0));
  mover.loop = true;
  const double round = 8.0 + std::sqrt(32.0);
  EXPECT_NEAR(
      (MoverAt(mover, 1.0 + 1.0 + 0.5 * round).solid.center - Vector3d(2.0, 0.0, 1.0)).norm(), 0.0,
      1e-9);
}

TEST(Mover, KeepsItsTimes) {
  MoverSpec mover;
  mover.waypoints = {{0.0, 0.0, 1.0}, {4.0, 0.0, 1.0}, {4.0, 0.0, 1.0}, {2.0, 0.0, 1.0}};
  mover.times = {1.0, 3.0, 5.0, 9.0};
  const auto x = [&](double t) { return MoverAt(mover, t).solid.center.x(); };
  const auto v = [&](double t) { return MoverAt(mover, t).velocity.x(); };
  EXPECT_EQ(x(-1.0), 0.0);
  EXPECT_EQ(v(-1.0), 0.0);
  EXPECT_NEAR(x(2.0), 2.0, 1e-12);
  EXPECT_EQ(v(2.0), 2.0);
  EXPECT_EQ(x(4.0), 4.0);
  EXPECT_EQ(v(4.0), 0.0);
  EXPECT_EQ(MoverAt(mover, 4.0).solid.yaw, 0.0);  // faces on
  EXPECT_NEAR(x(7.0), 3.0, 1e-12);
  EXPECT_EQ(v(7.0), -0.5);
  EXPECT_EQ(x(99.0), 2.0);
  EXPECT_EQ(v(99.0), 0.0);
}

TEST(Target, IsOfThreeShapes) {
  TargetSpec target;
  EXPECT_EQ(TargetSolid(target, Vector3d::Zero(), 0.3).kind, Solid::Kind::kCylinder);
  target.shape = "box";
  EXPECT_EQ(TargetSolid(target, Vector3d::Zero(), 0.3).yaw, 0.3);
  target.shape = "sphere";
  target.height = 0.3;
  const Solid ball = TargetSolid(target, Vector3d(1.0, 2.0, 3.0), 0.3);
  for (const Vector3d& d : {Vector3d(1, 0, 0), Vector3d(0, 0, 1), Vector3d(0.6, 0, 0.8)})
    EXPECT_NEAR(SignedDistance(ball, Vector3d(1.0, 2.0, 3.0) + 0.15 * d), 0.0, 1e-9);
}

TEST(Ground, RisesAlongItsSlope) {
  GroundSpec ground;
  ground.slope = {0.1, -0.2};
  EXPECT_NEAR(GroundHeight(ground, 10.0, 5.0), 0.0, 1e-12);
  EXPECT_NEAR(GroundHeight(ground, 10.0, 0.0), 1.0, 1e-12);
}

TEST(Ground, StaysWithinItsRoughness) {
  GroundSpec ground;
  ground.height = 0.5;
  ground.roughness = 0.2;
  double least = 1e9, most = -1e9;
  for (double x = -30.0; x < 30.0; x += 0.37)
    for (double y = -30.0; y < 30.0; y += 0.41) {
      least = std::min(least, GroundHeight(ground, x, y));
      most = std::max(most, GroundHeight(ground, x, y));
    }
  EXPECT_GE(least, 0.3);
  EXPECT_LE(most, 0.7);
  EXPECT_GT(most - least, 0.2);
}

std::string Shipped(const std::string& name) {
  return std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/" + name + ".yaml";
}

/// Free way of the target's cylinder and carrier to everything that stands in the scenario.
double LeastClearance(const Scenario& scenario) {
  const PathMotion path = TargetMotion(scenario);
  const auto solids = StaticSolids(scenario);
  double least = 1e9;
  for (double t = 0.0; t < path.Duration(); t += 0.1) {
    const Vector2d p = path.Position(t);
    for (const auto& solid : solids)
      least = std::min(least, SignedDistance(solid, {p.x(), p.y(), 0.5}));
  }
  return least;
}

TEST(Gym, IsTheHallOfThePaper) {
  const Scenario gym = LoadScenario(Shipped("gym"));
  ASSERT_EQ(gym.world.cylinders.size(), 7u);
  for (const auto& cylinder : gym.world.cylinders) EXPECT_EQ(cylinder.radius, 0.28);
  int gates = 0;
  for (int i = 0; i + 1 < 4; ++i) {
    const auto& a = gym.world.cylinders[static_cast<std::size_t>(i)];
    const auto& b = gym.world.cylinders[static_cast<std::size_t>(i) + 1];
    const double gap = (a.center - b.center).norm() - 0.56;
    gates += gap > 1.4 && gap < 1.8;
  }
  EXPECT_EQ(gates, 3);
  EXPECT_LE(gym.target.speed, 1.0);
  EXPECT_EQ(gym.duration_s, 60.0);
  EXPECT_GT(TargetMotion(gym).Duration(), 55.0);
  EXPECT_GT(LeastClearance(gym), 0.6);
}

TEST(Gym, PathKeepsItsDistanceFromTheWalls) {
  const PathMotion path = TargetMotion(LoadScenario(Shipped("gym")));
  for (double t = 0.0; t < path.Duration(); t += 0.05) {
    const Vector2d p = path.Position(t);
    EXPECT_LE(std::abs(p.y()), 4.0 - 0.75);
    EXPECT_LE(std::abs(p.x() - 7.5), 7.5 - 0.75);
  }
}

/// At every time there is a stand 2 to 3 m from the target, 0.5 m free of everything, that sees it.
TEST(Gym, AChaserFindsRoomAllTheWay) {
  const Scenario gym = LoadScenario(Shipped("gym"));
  const PathMotion path = TargetMotion(gym);
  const auto solids = StaticSolids(gym);
  for (double t = 0.0; t < gym.duration_s; t += 0.5) {
    const Vector2d p = path.Position(t);
    const Vector3d target(p.x(), p.y(), gym.target.base + 0.5 * gym.target.height);
    int stands = 0;
    for (int i = 0; i < 72; ++i) {
      const double angle = i * 0.0872664626;
      const Vector3d stand(p.x() + 2.5 * std::cos(angle), p.y() + 2.5 * std::sin(angle), 1.3);
      if (std::abs(stand.y()) > 4.0 || stand.x() < 0.0 || stand.x() > 15.0) continue;
      bool good = true;
      for (const auto& solid : solids)
        good = good && SignedDistance(solid, stand) > 0.5 && !SegmentHits(solid, stand, target);
      stands += good;
    }
    EXPECT_GE(stands, 8) << "at " << t << " s";
  }
}

TEST(Forest, HasItsTreesGapsAndFreePath) {
  const Scenario forest = LoadScenario(Shipped("forest"));
  std::vector<Solid> trunks;
  for (const auto& solid : StaticSolids(forest))
    if (solid.kind == Solid::Kind::kCylinder) trunks.push_back(solid);
  EXPECT_GE(trunks.size(), 450u);
  EXPECT_LE(trunks.size(), 550u);
  for (std::size_t i = 0; i < trunks.size(); ++i) {
    EXPECT_GE(trunks[i].half_size.x(), 0.15);
    EXPECT_LE(trunks[i].half_size.x(), 0.4);
    for (std::size_t j = 0; j < i; ++j) {
      const double apart = (trunks[i].center - trunks[j].center).head<2>().norm();
      EXPECT_GE(apart - trunks[i].half_size.x() - trunks[j].half_size.x(), 2.5 - 1e-9);
    }
  }
  EXPECT_GE(LeastClearance(forest), forest.world.forest.path_clearance - 0.1);
}

TEST(Forest, IsTheSameEveryTime) {
  const Scenario forest = LoadScenario(Shipped("forest"));
  const auto a = StaticSolids(forest), b = StaticSolids(forest);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].center, b[i].center);
}

TEST(Forest, MoversCrossTheChaseInTwoRegions) {
  const Scenario forest = LoadScenario(Shipped("forest"));
  const PathMotion path = TargetMotion(forest);
  EXPECT_GT(path.Duration(), 50.0);
  ASSERT_EQ(forest.movers.size(), 2u);
  std::vector<Vector2d> places;
  for (const auto& mover : forest.movers) {
    EXPECT_LE(mover.speed, 4.0);
    double least = 1e9;
    Vector2d place;
    for (double t = 0.0; t < forest.duration_s; t += 0.05) {
      const Vector2d p = path.Position(t);
      const Solid solid = MoverAt(mover, t).solid;
      const double d = SignedDistance(solid, {p.x(), p.y(), solid.center.z()});
      if (d < least) place = p, least = d;
    }
    EXPECT_GT(least, 0.6);  // misses the target
    EXPECT_LT(least, 4.0);  // but crosses where the chaser flies
    places.push_back(place);
  }
  EXPECT_GT((places[0] - places[1]).norm(), 15.0);
}

TEST(Forest, MoversPassBetweenTheTrees) {
  const Scenario forest = LoadScenario(Shipped("forest"));
  const auto solids = StaticSolids(forest);
  for (const auto& mover : forest.movers)
    for (double t = 0.0; t < forest.duration_s; t += 0.1) {
      const MoverState state = MoverAt(mover, t);
      for (const auto& solid : solids) {
        if (solid.kind != Solid::Kind::kCylinder) continue;
        if ((solid.center - state.solid.center).head<2>().norm() > 3.0) continue;
        Vector3d trunk = solid.center;
        trunk.z() = state.solid.center.z();
        EXPECT_GT(SignedDistance(state.solid, trunk), solid.half_size.x()) << "at " << t << " s";
      }
    }
}

}  // namespace
}  // namespace chase::world
