#include <gtest/gtest.h>

#include <algorithm>

#include "fcu_engaged.h"
#include "fcu_flight.h"
#include "services/fcu/bridge.h"
#include "services/fcu/touchdown.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

/// A flight that is pressed onto the ground with two thirds of the hover's thrust, as control
/// presses until it has felt the ground.
void Press(Flight* flight) {
  flight->TakeOff(5.0);
  flight->height = -3.0;
  flight->Run(8.0, [&] { return flight->px4.p_WB().z() <= 0.0; });
  flight->Run(2.0);
}

TEST(FcuTouchdown, Px4HasNotLandedByTouchingTheGround) {
  Flight flight;
  Press(&flight);
  EXPECT_NEAR(flight.px4.seen().setpoint->thrust, 0.35, 0.05);
  EXPECT_FALSE(flight.px4.landed());
  EXPECT_EQ(flight.state(), State::kFlying) << flight.bridge.Words();
}

TEST(FcuTouchdown, ThrustGoesDownUntilPx4HasLanded) {
  Flight flight;
  Press(&flight);
  flight.motors = false;
  flight.Run(1.5, [&] { return !flight.px4.armed() || flight.px4.mode() == kLandMode; });
  EXPECT_FALSE(flight.px4.armed()) << flight.bridge.Words();
  EXPECT_TRUE(flight.px4.mode() == kOffboardMode) << "without a landing of the autopilot's own";
  EXPECT_EQ(flight.px4.seen().setpoint->thrust, 0.0f);
  EXPECT_TRUE(flight.RunUntil(State::kDone, 1.5)) << flight.bridge.Words();
  EXPECT_EQ(flight.px4.p_WB().z(), 0.0);
}

TEST(FcuTouchdown, AnImuThatFallsSilentOnTheGroundDoesNotBringTheThrustBack) {
  Flight flight;
  Press(&flight);
  flight.motors = false;
  flight.Run(0.6);
  ASSERT_EQ(flight.state(), State::kTouchdown);
  flight.deaf = true;
  flight.Run(0.3);
  EXPECT_EQ(flight.state(), State::kLanding) << flight.bridge.Words();
  EXPECT_LT(flight.px4.seen().setpoint->thrust, 0.1f);
  flight.deaf = false;
  EXPECT_TRUE(flight.RunUntil(State::kDone, 10.0)) << flight.bridge.Words();
}

// Whoever takes the motors away in the air takes no more than half of the thrust for a moment.
TEST(FcuTouchdown, IsNoneInTheAir) {
  for (const bool body_rates : {false, true}) {
    FcuConfig config;
    config.body_rates = body_rates;
    Flight flight({}, config);
    flight.TakeOff(8.0);
    const double height = flight.px4.p_WB().z();
    flight.motors = false;
    flight.aside = 3.0;
    float least = 1.0f;
    Took(&flight, "motors off in the air, the autopilot lands", 1.0, [&] {
      least = std::min(least, flight.px4.seen().setpoint->thrust);
      return flight.px4.mode() == kLandMode;
    });
    EXPECT_GT(least, 0.25f) << "half of the hover";
    flight.Run(0.5);
    EXPECT_EQ(flight.state(), State::kLanding) << flight.bridge.Words();
    EXPECT_TRUE(flight.Says("it is in the air"));
    EXPECT_EQ(flight.px4.seen().setpoint->type_mask & 128, 0)
        << "an attitude: nobody closes the loop";
    EXPECT_GT(flight.px4.p_WB().z(), height - 0.5);
    EXPECT_GT(flight.px4.v_WB().z(), -0.7);
    EXPECT_TRUE(flight.RunUntil(State::kDone, 15.0)) << flight.bridge.Words();
  }
}

// AUTO.LAND waits for a heartbeat that says who has it, and may be lost.
TEST(FcuTouchdown, HoversUntilTheAutopilotLands) {
  Flight flight;
  flight.TakeOff(8.0);
  flight.motors = false;
  ASSERT_TRUE(flight.RunUntil(State::kLanding, 0.5)) << flight.bridge.Words();
  flight.Run(0.005);
  ASSERT_TRUE(flight.px4.mode() == kOffboardMode);
  flight.link = false;
  flight.Run(0.9);
  EXPECT_TRUE(flight.px4.mode() == kOffboardMode) << "COM_OF_LOSS_T has not passed";
  EXPECT_GT(flight.px4.v_WB().z(), -0.5);
}

TEST(FcuTouchdown, PilotAndKillReachIt) {
  for (const bool kill : {false, true}) {
    Flight flight;
    Press(&flight);
    flight.motors = false;
    ASSERT_TRUE(flight.RunUntil(State::kTouchdown, 0.5));
    if (kill) {
      flight.bridge.Kill();
      flight.Run(0.1);
      EXPECT_FALSE(flight.px4.armed());
    } else {
      flight.px4.PilotMode(kPosition);
      EXPECT_TRUE(flight.RunUntil(State::kPilot, 0.2)) << flight.bridge.Words();
    }
  }
}

// COM_DISARM_PRFLT counts, and disarming is not denied.
TEST(FcuTouchdown, ATakeOffIsCalledOffWhileTheMotorsIdle) {
  Flight flight;
  flight.idle = true;
  flight.TakeOff(5.0);
  EXPECT_TRUE(flight.px4.landed());
  EXPECT_TRUE(flight.Says("armed, on ground"));
  flight.motors = false;
  EXPECT_TRUE(flight.RunUntil(State::kDone, 0.5)) << flight.bridge.Words();
  EXPECT_FALSE(flight.px4.armed());

  Flight waits;
  waits.idle = true;
  waits.TakeOff(11.0);
  EXPECT_FALSE(waits.px4.armed());
  EXPECT_EQ(waits.state(), State::kRefused) << waits.bridge.Words();
  EXPECT_TRUE(waits.Says("refused: the autopilot has disarmed before a take-off;"))
      << "no answer's words";
}

TEST(FcuTouchdown, LandsByTheAutopilotWhereThatDoesNotCallItselfLanded) {
  Engaged flight(true);
  flight.facts.wish = false;
  flight.facts.motors_off = flight.facts.borne = true;
  flight.Run(4.5);
  EXPECT_EQ(flight.handshake.state(), State::kTouchdown);
  EXPECT_TRUE(flight.handshake.streams());
  flight.Run(1.0);
  EXPECT_EQ(flight.handshake.state(), State::kLanding);
}

TEST(FcuTouchdown, AnAccelerometerThatIsSilentShowsNoWeight) {
  Touchdown touchdown;
  EXPECT_FALSE(touchdown.IsBorne(kStart));
  for (int i = 0; i < 100; ++i)
    touchdown.Feel({kStart + 5'000 * i, Eigen::Vector3d(0.0, 3.0, 9.34), Eigen::Vector3d::Zero()});
  EXPECT_TRUE(touchdown.IsBorne(kStart + 500'000));
  EXPECT_FALSE(touchdown.IsBorne(kStart + 700'000));
}

TEST(FcuTouchdown, ThrustIsLoweredFromTheHoverWithoutAJump) {
  Touchdown begun_anew;
  EXPECT_GT(begun_anew.Lower(0.5, kStart), 0.4) << "nothing was sent before";
  Touchdown paused;
  paused.Flies(0.35, kStart);
  EXPECT_GT(paused.Lower(0.5, kStart + 700'000), 0.25);
}

}  // namespace
}  // namespace chase::fcu::testing
