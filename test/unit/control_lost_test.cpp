// What is flown without a position, and without a velocity.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/math/rotation.h"
#include "common/world/ages.h"
#include "test/unit/control_flight.h"

namespace chase::control {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::Body;
using test::Flight;
using test::kStep;
using test::LinePlan;
using test::PointPlan;

TEST(LostPose, BrakesOnTheInertialVelocityAndHoldsTheHeight) {
  Flight flight({0, 0, 2});
  flight.body.v = {3, 0, 0};
  flight.controller.AddPlan(LinePlan({0, 0, 2}, 3.0));
  flight.Fly(2.0, Health::kUsable);
  const Vector3d from = flight.body.p;
  flight.Fly(3.9, Health::kLost);
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
  const Vector3d way = flight.body.p - from;
  std::printf("braking from 3 m/s: %.2f m of way, %.2f m of height\n", way.head<2>().norm(),
              way.z());
  EXPECT_LT(flight.body.v.norm(), 0.1);
  EXPECT_LT(way.head<2>().norm(), 1.5);  // 8 m when it only sank
  EXPECT_LT(std::abs(way.z()), 0.15);
}

TEST(LostPose, LandsOnceTheVelocityIsTooOldAndStopsTheMotorsOnTheGround) {
  for (const double mass : {0.96, 1.0, 1.04})
    for (const double drift : {-0.03, 0.0, 0.03}) {
      Flight flight({0, 0, 2});
      flight.body.mass_factor = mass;
      flight.drift = {0.02, 0.02, drift};
      flight.controller.AddPlan(PointPlan({0, 0, 2}));
      flight.Fly(20.0, Health::kUsable);  // the trim is learnt
      flight.Fly(20.0 + world::kMostAge.velocity - 0.1, Health::kLost);
      EXPECT_EQ(flight.controller.following(), Following::kBrake);
      flight.Fly(35.0, Health::kLost);
      EXPECT_EQ(flight.controller.following(), Following::kLand);
      ASSERT_GT(flight.down_at, 0.0) << "mass " << mass << " drift " << drift;
      EXPECT_LT(flight.impact, 0.8) << "mass " << mass << " drift " << drift;
      EXPECT_GT(flight.off_at, flight.down_at) << "mass " << mass << " drift " << drift;
      EXPECT_LT(flight.off_at, flight.down_at + 1.0) << "mass " << mass << " drift " << drift;
      EXPECT_TRUE(flight.controller.is_down());
      EXPECT_EQ(flight.setpoint.thrust, 0.0);
    }
}

TEST(LostPose, LandsAgainstTheWindAndWithoutSkidding) {
  Flight flight({0, 0, 2});
  flight.drift = {0.03, -0.02, 0.02};
  flight.body.wind = {1.5, 0.0, 0.0};
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(20.0, Health::kUsable);
  flight.body.wind = {3.0, 1.0, 0.0};
  flight.Fly(35.0, Health::kLost);
  ASSERT_GT(flight.down_at, 0.0);
  EXPECT_LT(flight.skid, 0.35);
  EXPECT_LT(flight.impact, 0.75);
}

TEST(LostPose, HoldsSinceTheVelocityWasMeasuredNotSinceThePoseWasLost) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(5.0, Health::kUsable);
  flight.velocity_sigma = 0.2;
  flight.Fly(6.5, Health::kUsable);
  EXPECT_NE(flight.controller.following(), Following::kBrake);
  flight.Fly(6.9, Health::kLost);
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
  flight.Fly(7.2, Health::kLost);
  EXPECT_EQ(flight.controller.following(), Following::kLand);
}

TEST(LostPose, ASilentPoseIsBrakedWithoutByDeadReckoningHoweverDoubtfulTheVelocityWas) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.velocity_sigma = 0.2;
  flight.Fly(5.0, Health::kUsable);
  ASSERT_TRUE(flight.controller.Blind(0.2));
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
}

TEST(LostPose, LeansAgainstNoVelocityThatIsNotUsable) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(5.0, Health::kUsable);
  flight.drift = {1.0, 0.0, 0.0};
  flight.velocity_sigma = 1.01 * ControlConfig().UsableVelocitySigma();
  flight.Fly(7.5, Health::kLost);
  EXPECT_EQ(flight.controller.following(), Following::kLand);
  EXPECT_NEAR((flight.setpoint.R_WB * Vector3d::UnitZ()).z(), 1.0, 1e-9);
}

TEST(LostPose, AGapBetweenEstimatesIsNoGround) {
  Landing landing{ControlConfig()};
  Estimate felt;
  felt.a_WB.z() = 2.0;
  landing.Lift(felt, 2.0);
  EXPECT_FALSE(landing.is_down());
}

TEST(LostPose, ComesDownByAVelocityThatIsNotToBeTrusted) {
  for (const double drift : {-0.1, 0.0, 0.1}) {
    Flight flight({0, 0, 2});
    flight.drift.z() = drift;
    flight.controller.AddPlan(PointPlan({0, 0, 2}));
    flight.Fly(5.0, Health::kUsable);
    while (flight.t < 40.0) {
      flight.velocity_sigma = 0.1 * (flight.t - 5.0) + 0.6;
      flight.Fly(flight.t + 0.1, Health::kLost);
    }
    ASSERT_GT(flight.down_at, 0.0) << drift;
    EXPECT_LT(flight.off_at, flight.down_at + 1.0) << drift;
    EXPECT_GT(flight.off_at, flight.down_at) << drift;
    EXPECT_LT(flight.impact, 1.3) << drift;
  }
}

TEST(LostPose, MotorsRunAsLongAsItIsInTheAir) {
  for (const double gust : {-3.0, 3.0})
    for (const double mass : {0.96, 1.04}) {
      Flight flight({0, 0, 40});
      flight.body.mass_factor = mass;
      flight.controller.AddPlan(PointPlan({0, 0, 40}));
      flight.Fly(20.0, Health::kUsable);
      for (double until = 20.5; until < 60.0; until += 0.5) {
        flight.body.wind.z() = static_cast<int>(until) % 4 < 2 ? gust : 0.0;
        flight.Fly(until, Health::kLost);
      }
      EXPECT_LT(flight.off_at, 0.0) << "gust " << gust << " mass " << mass;
      EXPECT_LT(flight.body.p.z(), 30.0);
    }
}

TEST(LostPose, MotorsThatAreOffStayOff) {
  Flight flight({0, 0, 1});
  flight.controller.AddPlan(PointPlan({0, 0, 1}));
  flight.Fly(1.0, Health::kUsable);
  flight.Fly(12.0, Health::kLost);
  ASSERT_TRUE(flight.controller.is_down());
  flight.controller.AddPlan(PointPlan({0, 0, 1}, 12.0));
  flight.Fly(13.0, Health::kUsable);
  EXPECT_FALSE(flight.setpoint.motors);
}

TEST(LostPose, GoesBackToThePlanThatIsNear) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(1.0, Health::kUsable);
  flight.Fly(2.0, Health::kLost);
  flight.Fly(2.1, Health::kUsable);
  EXPECT_NE(flight.controller.following(), Following::kBrake);
}

TEST(LostPose, WaitsForANewPlanWhereItHasDrifted) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(1.0, Health::kUsable);
  flight.Fly(2.0, Health::kLost);
  flight.body.p += Vector3d(2, 0, 0);
  flight.Fly(2.5, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
  EXPECT_LT(flight.body.v.norm(), 0.2);  // no way back that nobody has certified
  EXPECT_EQ(flight.controller.AddPlan(PointPlan(flight.body.p, 2.5)), "");
  flight.Fly(2.6, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kPlan);
}

TEST(LostPose, BrakesWhenTheFrameHasChanged) {
  Flight flight({0, 0, 2});
  flight.body.v = {2, 0, 0};
  flight.controller.AddPlan(LinePlan({0, 0, 2}, 2.0));
  flight.Fly(1.0, Health::kUsable);
  flight.controller.ForgetPlans();
  flight.Fly(3.0, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
  EXPECT_LT(flight.body.v.norm(), 0.1);
}

TEST(LostPose, WithoutAVelocityItHoldsTheHeightForAWhileAndThenSinks) {
  const ControlConfig config;
  Controller controller(config);
  controller.AddPlan(PointPlan({0, 0, 0}));
  Estimate estimate;
  estimate.R_WB = math::FromYaw(0.7);
  controller.Update(0.0, estimate, Health::kUsable);
  const auto s = controller.Update(0.005, estimate, Health::kStarting);
  ASSERT_TRUE(s);
  EXPECT_NEAR((s->R_WB * Vector3d::UnitZ()).z(), 1.0, 1e-12);
  EXPECT_NEAR(math::Yaw(s->R_WB), math::Yaw(estimate.R_WB), 1e-9);
  EXPECT_NEAR(s->thrust, 9.81, 1e-9);
  EXPECT_EQ(controller.following(), Following::kBrake);
  const double until = world::kMostAge.velocity;
  EXPECT_NEAR(controller.Update(until - kStep, estimate, Health::kStarting)->thrust, 9.81, 1e-9);
  for (int i = 1; i < 4000; ++i) {  // standing still, or a sensor that says so: no reason to stop
    const auto sinking = controller.Update(until + i * kStep, estimate, Health::kStarting);
    EXPECT_TRUE(sinking->motors);
    EXPECT_NEAR(sinking->thrust, 9.81 - config.lost_descent, 1e-9);
    EXPECT_EQ(controller.following(), Following::kLand);
  }
}

/// Flies at 2 m/s until t = 2 s; from then on no pose comes for `silent` s, then poses that are
/// starting, in a frame that is turned by `turn` rad once they are aligned, for 1 s.
Vector3d WayWithoutPose(double silent, double turn, double wind, Body* body) {
  Flight flight({0, 0, 2});
  flight.body.v = {2, 0, 0};
  flight.body.wind = {0, wind, 0};
  flight.controller.AddPlan(LinePlan({0, 0, 2}, 2.0));
  flight.Fly(2.0, Health::kUsable);
  const Vector3d from = flight.body.p;
  Setpoint setpoint = flight.setpoint;
  for (int i = 1; i <= std::lround(silent / kStep); ++i) {
    if (i >= 30 && i % 10 == 0) setpoint = *flight.controller.Blind(i * kStep);
    flight.body.Step(setpoint);
  }
  flight.controller.ForgetPlans();
  const Quaterniond frame = math::FromYaw(turn);
  for (int i = 0; i < 200; ++i) {
    Estimate estimate = flight.body.Measured();
    estimate.R_WB = frame * estimate.R_WB;
    const double t = 2.0 + silent + i * kStep;
    if (i == 100) flight.controller.TurnFrame(t, math::Yaw(estimate.R_WB));
    setpoint = *flight.controller.Update(t, estimate, Health::kStarting);
    if (i >= 100) setpoint.R_WB = frame.conjugate() * setpoint.R_WB;
    flight.body.Step(setpoint);
  }
  *body = flight.body;
  return flight.body.p - from;
}

TEST(LostPose, BrakesByDeadReckoningWhileNoVelocityIsKnown) {
  for (const double silent : {0.3, 0.5, 2.0})
    for (const double turn : {0.0, -2.0, 3.0})
      for (const double wind : {0.0, 1.5}) {
        Body body;
        const Vector3d way = WayWithoutPose(silent, turn, wind, &body);
        EXPECT_LT(way.head<2>().norm(), 1.3 + 0.2 * wind * silent * silent)
            << silent << " " << turn << " " << wind;  // 2.6 to 5 m when it only levelled
        EXPECT_LT(std::abs(body.v.x()), 0.2);
        EXPECT_LT(body.v.head<2>().norm(), 0.2 + 0.25 * wind * (silent + 1.0));
        EXPECT_GT(way.z(), -0.9);
        EXPECT_LT(way.z(), 0.1);
      }
}

/// Flies at 2 m/s until t = 2 s, into a gust; from then on poses come `late` s late, for 2 s.
TEST(LostPose, BrakesByPosesThatComeLateAndWhatItAskedForSince) {
  for (const double late : {0.1, 0.3}) {
    Flight flight({0, 0, 2});
    flight.body.v = {2, 0, 0};
    flight.controller.AddPlan(LinePlan({0, 0, 2}, 2.0));
    flight.Fly(2.0, Health::kUsable);
    flight.body.wind = {0, 4, 0};
    std::vector<Estimate> poses;
    Setpoint setpoint = flight.setpoint;
    for (int i = 1; i <= 400; ++i) {
      poses.push_back(flight.body.Measured());
      const int then = i - static_cast<int>(std::lround(late / kStep));
      if (then >= 0) flight.controller.UpdateLate(2.0 + kStep * then, poses[then], Health::kUsable);
      if (i >= 30 && i % 10 == 0) setpoint = *flight.controller.Blind(i * kStep);
      flight.body.Step(setpoint);
    }
    // The gust takes 1 m/s^2 and a velocity of 0.25 m/s to lean against it, besides what it adds
    // while it is not known of; 1.5 m/s by dead reckoning alone.
    EXPECT_LT(std::abs(flight.body.v.x()), 0.1) << late;
    EXPECT_LT(flight.body.v.head<2>().norm(), 0.25 + late + 0.1) << late;
  }
}

// Poses that are older than what was heard, uncertain or not finite.
TEST(LostPose, LatePosesOfNoUseChangeNothing) {
  std::vector<Setpoint> asked[2];
  for (const bool told : {false, true}) {
    Flight flight({0, 0, 2});
    flight.body.v = {2, 0, 0};
    flight.controller.AddPlan(LinePlan({0, 0, 2}, 2.0));
    flight.Fly(2.0, Health::kUsable);
    Estimate wild = flight.body.Measured();
    wild.v_WB = {-3, 4, 1};
    Estimate none = wild;
    none.v_WB.x() = NAN;
    for (int i = 30; i <= 100; i += 10) {
      if (told) {
        flight.controller.UpdateLate(1.9, wild, Health::kUsable);
        flight.controller.UpdateLate(2.0 + kStep * i, wild, Health::kStarting);
        flight.controller.UpdateLate(2.0 + kStep * i, none, Health::kUsable);
      }
      asked[told].push_back(*flight.controller.Blind(i * kStep));
    }
  }
  for (size_t i = 0; i < asked[0].size(); ++i) {
    EXPECT_EQ(asked[0][i].R_WB.coeffs(), asked[1][i].R_WB.coeffs()) << i;
    EXPECT_EQ(asked[0][i].thrust, asked[1][i].thrust) << i;
  }
}

TEST(LostPose, SinksNoFasterThanDragAllows) {
  Flight flight({0, 0, 10});
  flight.controller.AddPlan(PointPlan({0, 0, 10}));
  flight.Fly(1.0, Health::kUsable);
  flight.Fly(5.0, Health::kStarting);
  EXPECT_LT(flight.body.v.z(), -0.1);
  EXPECT_GT(flight.body.v.z(), -0.7);
}

TEST(LostPose, APoseThatGoesWrongBeforeItIsLostMakesItSinkAllTheSame) {
  Controller controller(ControlConfig{});
  controller.AddPlan(PointPlan({0, 0, 1}));
  Estimate sinking;  // says 1 m too low, for as long as it takes to wind the integral up
  for (int i = 0; i < 4000; ++i) {
    const auto setpoint = controller.Update(i * kStep, sinking, Health::kUsable);
    sinking.a_WB.z() = setpoint->thrust - 9.81;  // as the accelerometer feels it
  }
  EXPECT_LT(controller.Update(23.0, sinking, Health::kStarting)->thrust, 9.81);
}

TEST(LostPose, KnowsTheTrueHoverThrust) {
  Flight flight({0, 0, 0});
  flight.body.mass_factor = 1.03;
  flight.body.p.z() = 1.0;
  flight.controller.AddPlan(PointPlan({0, 0, 1}));
  flight.Fly(25.0, Health::kUsable);
  flight.Fly(25.004, Health::kStarting);
  EXPECT_NEAR(flight.setpoint.thrust / 1.03, 9.81, 0.05);
}

// Its sender hung: the reference has gone on along the stop of the plan before.
TEST(NewPlans, AreJudgedWhereTheyWouldBeByNow) {
  const auto line = [](double start, double speed) {
    Plan plan = LinePlan({0, 0, 2}, speed);
    plan.position = {start, 2.0, Eigen::MatrixXd::Zero(2, 3)};
    plan.position.coefficients << speed * start, 0.0, 2.0, 2.0 * speed, 0.0, 0.0;
    return plan;
  };
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(line(0.0, 0.5));
  flight.Fly(1.5, Health::kUsable);
  EXPECT_EQ(flight.controller.AddPlan(line(0.1, 0.5)), "") << "late, and the same way";
  EXPECT_NE(flight.controller.AddPlan(line(0.2, 1.5)), "") << "1.5 m ahead by now";
  Plan over = line(0.3, 0.5);
  over.stop = PointPlan({0.6, 0, 2}, 1.2).position;
  over.stop->start = 1.2;
  EXPECT_NE(flight.controller.AddPlan(over), "") << "on its stop by now";
}

TEST(NewPlans, MoveTheReferenceNoFurtherThanAResetUnlessToTheBody) {
  const ControlConfig config;
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(1.0, Health::kUsable);
  const double reset = config.reset_distance;
  EXPECT_EQ(flight.controller.AddPlan(PointPlan({0.99 * reset, 0, 2}, 1.1)), "");
  EXPECT_NE(flight.controller.AddPlan(PointPlan({2.1 * reset, 0, 2}, 1.2)), "");
  EXPECT_NE(flight.controller.AddPlan(PointPlan({0, 0, 2 - 2.1 * reset}, 1.2)), "");
  flight.body.p.x() += 3.0;  // off the plan: a reset starts at the body
  flight.Fly(1.005, Health::kUsable);
  EXPECT_EQ(flight.controller.AddPlan(PointPlan({3, 0, 2}, 1.2)), "");
}

TEST(NewPlans, HoldForABodyInTheirTubeWhereTheyAreCertified) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(1.0, Health::kUsable);
  const auto certified = [](double x, double tube) {
    Plan plan = PointPlan({x, 0, 2}, 1.1);
    plan.tube = tube;
    return plan;
  };
  EXPECT_NE(flight.controller.AddPlan(certified(0.2, 0.12)), "") << "near the reference";
  EXPECT_EQ(flight.controller.AddPlan(certified(0.2, 0.25)), "");
  EXPECT_EQ(flight.controller.AddPlan(certified(0.1, 0.12)), "");
  flight.body.p.x() += 0.25;
  flight.Fly(1.005, Health::kUsable);
  EXPECT_EQ(flight.controller.AddPlan(certified(0.3, 0.12)), "") << "from the body";
  EXPECT_EQ(flight.controller.AddPlan(certified(0.3, 0.01)), "") << "goes on along the last one";
  const double reset = ControlConfig().reset_distance;
  EXPECT_NE(flight.controller.AddPlan(certified(0.25 + 1.1 * reset, 1.2 * reset)), "")
      << "a tube leads no farther than a reset";
}

}  // namespace
}  // namespace chase::control
