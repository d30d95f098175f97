#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/rotation.h"
#include "common/world/random.h"
#include "services/simulator/simulator.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

world::Scenario Gym() {
  return world::LoadScenario(std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/gym.yaml");
}

SimulatorConfig Blind() {
  SimulatorConfig config;
  config.lidar.rate = config.camera.rate = 0.0;
  return config;
}

/// A plain pilot: climbs to a height above the start and holds its place.
AttitudeSetpoint Pilot(const BodyState& body, const Vector3d& place) {
  const Vector3d wanted = 2.0 * (place - body.p) - 2.5 * body.v;
  const Vector3d a = wanted.cwiseMax(-3.0).cwiseMin(3.0) + Vector3d(0.0, 0.0, kGravity);
  AttitudeSetpoint setpoint;
  setpoint.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), a);
  setpoint.thrust = a.norm();
  return setpoint;
}

TEST(Simulator, StandsUntilToldToFly) {
  const auto gym = Gym();
  Simulator simulator(gym, Blind());
  Output output;
  for (int i = 0; i < 600; ++i) output = simulator.Advance(0.005 * i);
  EXPECT_LT((output.truth.body.p - gym.chaser.start).norm(), 0.01);
  EXPECT_NEAR(output.imu.accel.z(), kGravity, 0.3);
  EXPECT_NEAR(output.truth.mission_time, 599 * 0.005 - gym.settle_s, 1e-9);
}

TEST(Simulator, TakesOffAndHovers) {
  const auto gym = Gym();
  Simulator simulator(gym, Blind());
  const Vector3d place = gym.chaser.start + Vector3d(0.0, 0.0, gym.chaser.takeoff_height);
  Output output = simulator.Advance(0.0);
  for (int i = 1; i < 1600; ++i) {
    simulator.SetSetpoint(Pilot(output.truth.body, place), 0.005 * i);
    output = simulator.Advance(0.005 * i);
  }
  // 2 % too little thrust, held by a gain of 2 / s^2: 0.1 m low.
  EXPECT_NEAR(output.truth.body.p.z(), place.z() - 0.02 * kGravity / 2.0, 0.02);
  EXPECT_LT((output.truth.body.p - place).head<2>().norm(), 0.02);
  EXPECT_LT(output.truth.body.v.norm(), 0.02);
}

TEST(Simulator, DescendsLevelWhenSetpointsStop) {
  auto gym = Gym();
  gym.chaser.start.z() = 3.0;
  Simulator simulator(gym, Blind());
  AttitudeSetpoint tilted;
  tilted.thrust = 10.0;
  tilted.orientation = Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  Output output;
  for (int i = 0; i < 2400; ++i) {
    const double t = 0.005 * i;
    if (t < 0.3) simulator.SetSetpoint(tilted, t);
    output = simulator.Advance(t);
    if (t < 0.75) {
      EXPECT_GT(output.truth.body.p.z(), 2.5);
    }
    if (t > 2.0 && t < 4.0) {
      EXPECT_NEAR(output.truth.body.v.z(), -0.5, 0.15);
      EXPECT_GT((output.truth.body.q * Vector3d::UnitZ()).z(), 0.999);
    }
  }
  EXPECT_NEAR(output.truth.body.p.z(), 0.12, 0.02);  // landed, and rests
  EXPECT_LT(output.truth.body.v.norm(), 1e-3);
}

TEST(Simulator, DescendsAtItsSpeedWithMotorsThatGiveLess) {
  const auto gym = Gym();
  SimulatorConfig weak = Blind();
  weak.vehicle.thrust_error = -0.1;
  Simulator simulator(gym, weak);
  const Vector3d place = gym.chaser.start + Vector3d(0.0, 0.0, 4.0);
  Output output = simulator.Advance(0.0);
  for (int i = 1; i < 2400; ++i) {
    const double t = 0.005 * i;
    if (t < 9.0) simulator.SetSetpoint(Pilot(output.truth.body, place), t);
    output = simulator.Advance(t);
    EXPECT_GT(output.truth.body.v.z(), t < 9.0 ? -1.0 : -0.65) << t;
  }
  EXPECT_NEAR(output.truth.body.v.z(), -0.5, 0.1);
}

/// Flies level at `v_WB` [m/s] until setpoints end at t = 2 s, and lands; vision's frame O is
/// turned by `yaw` and tells the truth while `sees`. Returns the flight from the end of setpoints
/// on.
std::vector<BodyState> Landing(const Vector3d& v_WB, double yaw,
                               const std::function<bool(double)>& sees) {
  auto gym = Gym();
  gym.chaser.start.z() = 4.0;
  Simulator simulator(gym, Blind());
  const Eigen::Quaterniond R_OW = math::FromYaw(-yaw);
  std::vector<BodyState> flown;
  for (int i = 0; i < 2400; ++i) {
    const double t = 0.005 * i;
    const BodyState body = simulator.body();
    if (t < 2.0) {
      AttitudeSetpoint setpoint =
          Pilot(body, body.p + 1.25 * v_WB + Vector3d(0, 0, 4 - body.p.z()));
      setpoint.orientation = R_OW * setpoint.orientation;
      simulator.SetSetpoint(setpoint, t);
    } else {
      flown.push_back(body);
    }
    const Output output = simulator.Advance(t);
    const BodyState& now = output.truth.body;
    simulator.estimator().Predict(5'000 * i, now, output.imu.accel);
    if (sees(t))
      simulator.estimator().Correct(
          {5'000 * i, R_OW * now.p, R_OW * now.v, math::Yaw(now.q) - yaw, 0});
  }
  return flown;
}

/// v^2 / 2a of the 3 m/s^2 that it brakes by, with the half second in which the last setpoint
/// holds.
TEST(Simulator, BrakesAndStaysByVisionWhenSetpointsStop) {
  world::Random random(7);
  for (int trial = 0; trial < 10; ++trial) {
    const double heading = random.Uniform(-3.0, 3.0), speed = random.Uniform(0.0, 2.5);
    const Vector3d v = speed * Vector3d(std::cos(heading), std::sin(heading), 0.0);
    const auto flown = Landing(v, random.Uniform(-3.0, 3.0), [](double) { return true; });
    const double start = flown.front().v.head<2>().norm();
    const Vector3d& begun = flown[100].p;  // the setpoints are 0.5 s old
    for (const BodyState& body : flown)
      EXPECT_LT((body.p - flown.front().p).head<2>().norm(), 0.1 + 0.9 * start + start * start / 6)
          << trial;
    EXPECT_LT((flown.back().p - begun).head<2>().norm(), 0.15) << trial;
    EXPECT_NEAR(flown.back().p.z(), 0.12, 0.02);
  }
}

/// PX4 reckons 5 s by its accelerometer, from then on it sinks level.
TEST(Simulator, StaysForAWhileAfterVisionEndsAndThenSinksLevel) {
  const auto before = [](double end) { return [end](double t) { return t < end; }; };
  const auto reckoned = Landing({2.0, 0.0, 0.0}, 1.0, before(2.0));
  EXPECT_LT(reckoned[600].v.head<2>().norm(), 0.4);  // 3 s: a bias of 0.05 m/s^2 and more
  EXPECT_GT((reckoned[600].p - reckoned[300].p).head<2>().norm(), 0.01) << "it knows the truth";
  const auto blind = Landing({2.0, 0.0, 0.0}, 1.0, [](double) { return false; });
  EXPECT_GT(blind[300].v.head<2>().norm(), 0.8) << "it brakes by a velocity that nobody told";
}

TEST(Simulator, RefusesAnOrientationOfNoLength) {
  Simulator simulator(Gym(), Blind());
  AttitudeSetpoint bad;
  bad.orientation.coeffs().setZero();
  bad.thrust = 20.0;
  Output output;
  for (int i = 0; i < 100; ++i) {
    simulator.SetSetpoint(bad, 0.005 * i);
    output = simulator.Advance(0.005 * i);
  }
  EXPECT_TRUE(output.truth.body.p.allFinite());
  EXPECT_LT(output.truth.body.p.z(), 0.13);
}

TEST(Simulator, SensorsComeAtTheirRates) {
  Simulator simulator(Gym(), SimulatorConfig{});
  int sweeps = 0, images = 0;
  for (int i = 0; i <= 200; ++i) {
    const Output output = simulator.Advance(0.005 * i);
    sweeps += output.sweep.has_value();
    images += output.image.has_value();
    if (output.sweep) {
      EXPECT_GT(output.sweep->x.size(), 15000u);
    }
  }
  EXPECT_EQ(sweeps, 10);
  EXPECT_EQ(images, 21);
}

TEST(Simulator, TargetWaitsForTheMissionAndEndsItsPath) {
  const auto gym = Gym();
  const Actors actors(gym);
  EXPECT_EQ(actors.Target(-3.0).center, actors.Target(0.0).center);
  EXPECT_EQ(actors.Target(-3.0).velocity, Vector3d(0.0, 0.0, 0.0));
  EXPECT_NEAR(actors.Target(0.0).center.z(), gym.target.base + 0.5 * gym.target.height, 1e-12);
  EXPECT_EQ(actors.Target(100.0).velocity, Vector3d(0.0, 0.0, 0.0));
  const auto& end = gym.target.waypoints.back();
  EXPECT_NEAR((actors.Target(100.0).center.head<2>() - end).norm(), 0.0, 1e-6);
}

TEST(Simulator, TargetStartsInViewAtTheDesiredDistance) {
  const auto gym = Gym();
  const Vector3d place = gym.chaser.start + Vector3d(0.0, 0.0, gym.chaser.takeoff_height);
  const Vector3d apart = Actors(gym).Target(0.0).center - place;
  EXPECT_NEAR(apart.head<2>().norm(), gym.chaser.desired_distance, 0.1);
  SimulatorConfig config;
  Camera camera(config.camera, config.rig, gym.target.color, 1);
  Scene scene(gym);
  camera.Render(place, Eigen::Quaterniond::Identity(), 0.0, scene,
                Actors(gym).Target(0.0).cylinder);
  EXPECT_TRUE(camera.View().in_image);
  EXPECT_EQ(camera.View().visible_share, 1.0);
}

/// Skipped ticks change nothing of the physics, only what is sampled.
TEST(Simulator, PhysicsDoNotDependOnTheTicks) {
  auto gym = Gym();
  gym.chaser.start.z() = 5.0;
  gym.wind.gust = 1.0;
  Simulator every(gym, Blind()), some(gym, Blind());
  Output a, b;
  for (int i = 0; i <= 100; ++i) a = every.Advance(0.005 * i);
  for (int i = 0; i <= 4; ++i) b = some.Advance(0.125 * i);
  EXPECT_EQ(a.truth.body.p, b.truth.body.p);
  EXPECT_EQ(a.truth.body.q.coeffs(), b.truth.body.q.coeffs());
}

TEST(SimulatorConfig, ProblemsAreNamed) {
  SimulatorConfig config;
  EXPECT_EQ(config.Problem(), "");
  config.lidar.rate = 50.0;
  EXPECT_NE(config.Problem().find("lidar: rate"), std::string::npos);
  config = {};
  config.vehicle.mass = 0.0;
  EXPECT_NE(config.Problem().find("vehicle: mass"), std::string::npos);
  config = {};
  config.setpoint_timeout = 0.0;
  EXPECT_NE(config.Problem().find("setpoint_timeout"), std::string::npos);
}

}  // namespace
}  // namespace chase::simulator
