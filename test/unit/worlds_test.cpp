// Worlds of chase-world: each loads, is fair by brute force on points against the true solids, and
// is unlike the others. CHASE_WORLD_SEEDS=500 build/test/worlds_test looks at 500 of each kind.

#include "deploy/worlds/worlds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <ostream>
#include <set>

#include "common/config/config.h"
#include "deploy/flight/flight_configs.h"

namespace chase::worlds {

void PrintTo(const Kind& kind, std::ostream* out);
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

constexpr double kDrone = 0.55;  // m: the drone's radius and 0.3
constexpr double kTarget = 0.1;  // m around target and carrier
constexpr double kWalker = 0.6;  // m between a mover and the target
constexpr int kAround = 20;      // points on a circle

uint64_t Seeds() {
  const char* text = std::getenv("CHASE_WORLD_SEEDS");
  return text ? std::strtoull(text, nullptr, 10) : 2;
}

/// Points of an upright cylinder: circles of several radii at several heights.
std::vector<Vector3d> Column(const Vector3d& foot, double radius, double height) {
  std::vector<Vector3d> points;
  const int levels = std::max(1, static_cast<int>(std::ceil(height / 0.2)));
  for (int level = 0; level <= levels; ++level)
    for (const double share : {0.0, 0.5, 1.0})
      for (int i = 0; i < (share > 0.0 ? kAround : 1); ++i) {
        const double a = 6.283185307179586 * i / kAround, r = share * radius;
        points.push_back(foot +
                         Vector3d(r * std::cos(a), r * std::sin(a), height * level / levels));
      }
  return points;
}

/// The surface and the inside of a body as a grid in its own axes.
std::vector<Vector3d> GridIn(const Solid& body) {
  std::vector<Vector3d> points;
  const Eigen::AngleAxisd turn(body.yaw, Vector3d::UnitZ());
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j)
      for (int k = -4; k <= 4; ++k) {
        Vector3d unit(i / 4.0, j / 4.0, k / 4.0);
        if (body.kind != Solid::Kind::kBox && unit.head<2>().norm() > 1.0)
          unit.head<2>().normalize();
        points.push_back(body.center + turn * body.half_size.cwiseProduct(unit));
      }
  return points;
}

/// One world as its file tells it.
class World {
 public:
  explicit World(const std::string& text)
      : scenario(world::ParseScenario(text, "world.yaml")),
        solids_(world::StaticSolids(scenario)),
        path(world::TargetMotion(scenario)) {}

  double Ground(const Vector2d& p) const {
    return world::GroundHeight(scenario.world.ground, p.x(), p.y());
  }
  Vector3d OnGround(const Vector2d& p) const { return {p.x(), p.y(), Ground(p)}; }
  Vector3d Target(double t) const {
    return OnGround(path.Position(t)) +
           Vector3d(0.0, 0.0, scenario.target.base + 0.5 * scenario.target.height);
  }
  Vector3d Hover() const {
    return scenario.chaser.start + Vector3d(0.0, 0.0, scenario.chaser.takeoff_height);
  }
  /// Greatest distance of a point of target or carrier from its axis.
  double Reach() const {
    const auto& t = scenario.target;
    const double body = t.shape == "box" ? std::sqrt(2.0) * t.radius : t.radius;
    return std::max(body, 0.5 * t.carrier_size.head<2>().norm());
  }
  bool AllFree(const std::vector<Vector3d>& points, double reach) const {
    for (const Solid& solid : solids_) {
      if ((solid.center - points.front()).norm() > solid.half_size.norm() + reach) continue;
      for (const Vector3d& p : points)
        if (SignedDistance(solid, p) <= 0.0) return false;
    }
    return true;
  }
  std::size_t Count(Solid::Kind kind) const {
    std::size_t n = 0;
    for (const Solid& solid : solids_) n += solid.kind == kind;
    return n;
  }

  world::Scenario scenario;

 private:
  std::vector<Solid> solids_;

 public:
  world::PathMotion path;
};

flight::FlightConfigs Configs(const World& world) {
  flight::FlightOptions options;
  options.scenario_file = "world.yaml";
  return flight::Configure(world.scenario, options);
}

void ExpectFreeWay(const World& world) {
  const double top = world.scenario.target.base + world.scenario.target.height;
  const double flight = world.scenario.chaser.takeoff_height + 0.12 - kDrone;
  for (double t = 0.0; t < world.path.Duration(); t += 0.1) {
    const Vector3d foot = world.OnGround(world.path.Position(t));
    const auto target = Column(foot + Vector3d(0.0, 0.0, 0.05), world.Reach() + kTarget, top);
    ASSERT_TRUE(world.AllFree(target, 3.0)) << "target at " << t << " s";
    const auto drone = Column(foot + Vector3d(0.0, 0.0, flight), kDrone, 2.0 * kDrone);
    ASSERT_TRUE(world.AllFree(drone, 3.0)) << "drone above the way at " << t << " s";
  }
}

void ExpectPossibleMotion(const World& world) {
  constexpr double kStep = 0.02;
  EXPECT_GE(world.path.Duration(), world.scenario.duration_s - 3.0);
  for (double t = 0.0; t + kStep < world.path.Duration(); t += kStep) {
    const Vector2d v = (world.path.Position(t + kStep) - world.path.Position(t)) / kStep;
    ASSERT_LE(v.norm(), 3.01) << t;
    const Vector2d a = (world.path.Velocity(t + kStep) - world.path.Velocity(t)) / kStep;
    ASSERT_LE(a.norm(), 4.0) << t;
  }
}

/// The angles of the target from the camera's axis, without the rig's own projection.
bool InImage(const World& world, const world::Rig& rig) {
  const double yaw = world.scenario.chaser.yaw_deg * kPi / 180.0;
  const Eigen::AngleAxisd to_body(-yaw, Vector3d::UnitZ());
  const double pitch = rig.camera_pitch_deg * kPi / 180.0;
  const Vector3d b = to_body * (world.Target(0.0) - world.Hover()) - rig.camera_position;
  const double forward = std::cos(pitch) * b.x() - std::sin(pitch) * b.z();
  const double up = std::sin(pitch) * b.x() + std::cos(pitch) * b.z();
  return forward > 0.0 && std::abs(b.y()) < forward * 0.5 * rig.width_px / rig.focal_px &&
         std::abs(up) < forward * 0.5 * rig.height_px / rig.focal_px;
}

void ExpectFairStart(const World& world, bool hidden) {
  const Vector3d start = world.scenario.chaser.start;
  EXPECT_NEAR(start.z(), world.Ground(start.head<2>()) + 0.12, 0.01);
  const double climb = world.scenario.chaser.takeoff_height;
  EXPECT_TRUE(world.AllFree(Column(start, kDrone, climb + kDrone), 4.0)) << "the climb";
  const auto configs = Configs(world);
  EXPECT_EQ(InImage(world, configs.simulator.rig), !hidden);
  std::vector<Vector3d> line;
  for (double s = 0.0; s <= 1.0; s += 0.002)
    line.push_back(world.Hover() + s * (world.Target(0.0) - world.Hover()));
  EXPECT_TRUE(world.AllFree(line, 8.0)) << "the first line of sight";
  for (const auto& mover : world.scenario.movers)
    for (const Vector3d& p : line)
      ASSERT_GT(SignedDistance(world::MoverAt(mover, 0.0).solid, p), 0.0) << "a mover hides it";
}

void ExpectFairMovers(const World& world, const std::string& kind) {
  const bool people = kind == "crowd" || kind == "mixed";
  const double bolt_room = world.scenario.chaser.desired_distance + 3.7;  // m to the target
  for (const auto& mover : world.scenario.movers)
    for (double t = -world.scenario.settle_s; t < world.scenario.duration_s; t += 0.07) {
      const auto state = world::MoverAt(mover, t);
      const double faster = state.velocity.norm() - world::MoverAt(mover, t - 0.07).velocity.norm();
      const bool bolts = t > 0.0 && faster > 1.6;
      const auto points = GridIn(state.solid);
      ASSERT_TRUE(world.AllFree(points, 5.0)) << "mover in something at " << t << " s";
      const Vector2d target = world.path.Position(t), hover = world.Hover().head<2>();
      for (const Vector3d& p : points) {
        ASSERT_GE((p.head<2>() - target).norm(), world.Reach() + kWalker) << t;
        ASSERT_TRUE(t >= 3.0 || (p.head<2>() - hover).norm() >= 1.0) << "at the hover, " << t;
        ASSERT_TRUE(!bolts || (p.head<2>() - target).norm() >= bolt_room) << "bolts, " << t;
      }
      if (!people) continue;
      ASSERT_LE(state.velocity.head<2>().norm(), 1.45);
      ASSERT_TRUE(state.solid.half_size.x() >= 0.199 && state.solid.half_size.x() <= 0.301);
    }
}

void ExpectHonestSetup(const World& world) {
  const auto configs = Configs(world);
  const world::Rig& truth = configs.simulator.rig;
  for (const world::Rig& rig : {configs.odometry.rig, configs.perception.rig}) {
    EXPECT_LT((rig.lidar_position - truth.lidar_position).norm(), 0.03);
    EXPECT_LT((rig.lidar_rpy_deg - truth.lidar_rpy_deg).norm(), 1.0);
    EXPECT_LT((rig.camera_position - truth.camera_position).norm(), 0.03);
    EXPECT_LT(std::abs(rig.camera_pitch_deg - truth.camera_pitch_deg), 1.0);
  }
  const auto& vehicle = configs.simulator.vehicle;
  EXPECT_TRUE(std::abs(vehicle.mass_error) >= 0.0499 && std::abs(vehicle.mass_error) <= 0.1001);
  EXPECT_NE(vehicle.drag, configs.control.drag);
  EXPECT_GE(world.scenario.chaser.desired_distance, 1.9);
  EXPECT_LE(world.scenario.chaser.desired_distance, 4.0);
  EXPECT_GE(world.scenario.target.speed, 0.5);
}

struct Range {
  std::size_t least, most;
};

void ExpectContents(const World& world, const std::string& kind) {
  const std::map<std::string, Range> round = {
      {"grove", {70, 130}}, {"park", {20, 60}}, {"field", {10, 10}}, {"forest", {180, 600}}};
  const std::map<std::string, Range> movers = {{"crowd", {4, 8}}, {"mixed", {2, 4}}};
  const auto expect = [&](const std::map<std::string, Range>& ranges, std::size_t count) {
    const auto range = ranges.find(kind);
    if (range == ranges.end()) return;
    EXPECT_GE(count, range->second.least);
    EXPECT_LE(count, range->second.most);
  };
  expect(round, world.Count(Solid::Kind::kCylinder));
  expect(movers, world.scenario.movers.size());
  const double rise = world.scenario.world.ground.slope.norm();
  EXPECT_EQ(rise > 0.06, kind == "slope") << rise;
}

class EachKind : public ::testing::TestWithParam<Kind> {};

TEST_P(EachKind, IsFairAndUnlikeTheOthers) {
  std::set<std::string> texts;
  for (uint64_t seed = 1; seed <= Seeds(); ++seed) {
    SCOPED_TRACE(GetParam().name + " --seed " + std::to_string(seed));
    const auto scenario = MakeWorld(GetParam().name, seed, {});
    const std::string text = WorldText(scenario);
    const World world(text);
    EXPECT_EQ(config::Dump(world.scenario), config::Dump(scenario)) << "not the same when loaded";
    std::string content = text.substr(text.find("world:"));  // without name and description
    EXPECT_TRUE(texts.insert(content).second) << "the same world twice";
    ExpectFreeWay(world);
    ExpectPossibleMotion(world);
    ExpectFairStart(world, false);
    ExpectFairMovers(world, GetParam().name);
    ExpectHonestSetup(world);
    ExpectContents(world, GetParam().name);
  }
}

TEST_P(EachKind, IsTheSameEveryTime) {
  EXPECT_EQ(WorldText(MakeWorld(GetParam().name, 11, {})),
            WorldText(MakeWorld(GetParam().name, 11, {})));
}

TEST_P(EachKind, MayHideTheTargetAtTheStart) {
  Options options;
  options.hidden_start = true;
  options.duration = 20.0;
  const World world(WorldText(MakeWorld(GetParam().name, 5, options)));
  EXPECT_EQ(world.scenario.duration_s, 20.0);
  ExpectFairStart(world, true);
  EXPECT_EQ(world.path.Position(10.0), world.path.Position(0.0)) << "it does not wait";
}

INSTANTIATE_TEST_SUITE_P(Worlds, EachKind, ::testing::ValuesIn(Kinds()),
                         [](const auto& kind) { return kind.param.name; });

TEST(View, IsThatOfTheRigThatPerceptionHas) {
  world::Scenario scenario = MakeWorld("hall", 1, {});
  scenario.services.clear();
  flight::FlightOptions options;
  options.scenario_file = "world.yaml";
  const auto straight = flight::Configure(scenario, options).planning.planner;
  scenario.services.push_back({"perception", "rig: {camera_roll_deg: -2, camera_yaw_deg: 3}"});
  const auto askew = flight::Configure(scenario, options).planning.planner;
  EXPECT_NEAR(askew.view_down_deg, straight.view_down_deg - 5.0, 1e-9);
  EXPECT_NEAR(askew.view_up_deg, straight.view_up_deg - 5.0, 1e-9);
  EXPECT_NEAR(askew.max_bearing_deg, straight.max_bearing_deg - 5.0, 1e-9);
}

// Nothing is known by accident: what control and fcu go by is 5 to 10 % away from what flies.
TEST(Vehicle, IsDrawnFromTheSeedWhereverSensorsAreFlown) {
  world::Scenario scenario = MakeWorld("hall", 1, {});
  scenario.services.clear();
  scenario.sensors.mode = "raw";
  flight::FlightOptions options;
  options.scenario_file = "world.yaml";
  std::set<double> masses;
  for (options.seed = 1; options.seed <= 20; ++options.seed) {
    const auto configs = flight::Configure(scenario, options);
    const auto& vehicle = configs.simulator.vehicle;
    masses.insert(vehicle.mass_error);
    const double curve = vehicle.thrust_curve * (1.0 - simulator::kGravity / vehicle.max_thrust);
    std::vector<double> off = {vehicle.mass_error, curve};
    for (int i = 0; i < 3; ++i) off.push_back(vehicle.drag[i] / configs.control.drag[i] - 1.0);
    for (const double share : off)
      EXPECT_TRUE(std::abs(share) >= 0.0499 && std::abs(share) <= 0.1001) << share;
    EXPECT_EQ(configs.fcu.hover_thrust, simulator::kGravity / vehicle.max_thrust) << "the nominal";
    EXPECT_EQ(configs.planning.planner.drag, configs.control.drag.head<2>().mean());
    EXPECT_TRUE(configs.simulator.battery.sags);
  }
  EXPECT_EQ(masses.size(), 20u);
  const auto named = [&](const std::string& text) {
    world::Scenario told = scenario;
    told.services.push_back({"simulator", text});
    return flight::Configure(told, options).simulator;
  };
  EXPECT_EQ(named("vehicle: {mass_error: 0.01}").vehicle.mass_error, 0.01) << "what it names holds";
  options.sensors = "truth";
  const auto truth = named("seed: 1");
  EXPECT_EQ(truth.vehicle.mass_error, 0.0);
  EXPECT_FALSE(truth.battery.sags);
}

TEST(Configure, TheLidarsDriverGoesByTheClockThatItsSensorHas) {
  world::Scenario scenario = MakeWorld("hall", 1, {});
  scenario.services.clear();
  flight::FlightOptions options;
  options.scenario_file = "world.yaml";
  EXPECT_EQ(flight::Configure(scenario, options).lidar.clock, "arrival");
  scenario.services.push_back({"simulator", "hardware: {lidar_clock: gps, position_port: 8309}"});
  const auto lidar = flight::Configure(scenario, options).lidar;
  EXPECT_EQ(lidar.clock, "gps");
  EXPECT_EQ(lidar.position_port, 8309);
}

TEST(Configure, RefusesPlansThatLeadToWhereNothingIsListed) {
  const auto problem = [](const std::string& service, const std::string& text) -> std::string {
    world::Scenario scenario = MakeWorld("hall", 1, {});
    scenario.services.push_back({service, text});
    flight::FlightOptions options;
    options.scenario_file = "world.yaml";
    try {
      flight::Configure(scenario, options);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(problem("mapping", "statics: {band_high: 2.0}").find("band_high 2 m"),
            std::string::npos);
  EXPECT_NE(problem("mapping", "statics: {radius: 5.0}").find("statics.radius 5 m"),
            std::string::npos);
  EXPECT_NE(problem("mapping", "statics: {unseen: 2.0}").find("statics.unseen is 2 m"),
            std::string::npos);
  EXPECT_EQ(problem("mapping", "statics: {unseen: 0.0}"), "");
}

TEST(Worlds, UnknownKindIsRefusedWithTheKnownOnes) {
  try {
    MakeWorld("swamp", 1, {});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("corridor"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace chase::worlds
