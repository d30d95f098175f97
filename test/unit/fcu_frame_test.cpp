// When the frame W of odometry changes, and when the autopilot's heading is another.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "fcu_flight.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

// Odometry that begins anew in flight has another heading: the body must not turn to it.
TEST(FcuFrame, AFrameThatTurnsInFlightTurnsNoBody) {
  Flight flight;
  flight.TakeOff(6.0);
  double worst = 0.0, farthest = 0.0;
  const auto watch = [&] {
    worst = std::max(worst, std::abs(math::Yaw(flight.px4.R_WB())));
    farthest = std::max(farthest, flight.px4.p_WB().head<2>().norm());
    return false;
  };
  for (const double turned : {1.2, -2.5, 0.1}) {
    ++flight.epoch;
    flight.turned = turned;
    flight.Run(5.0, watch);
    EXPECT_EQ(flight.state(), State::kFlying) << flight.bridge.Words();
    const auto& q = flight.px4.seen().vision->q;
    const Eigen::Quaterniond told = SwapFrames(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
    EXPECT_LT(told.angularDistance(flight.px4.R_WB()), 0.02) << "ODOMETRY turns as little";
    EXPECT_EQ(flight.px4.seen().vision->reset_counter, flight.epoch);
  }
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(farthest, 0.05);
  flight.bridge = Bridge(FcuConfig{});  // begins anew, in a frame that lies elsewhere
  flight.epoch += 5;
  flight.turned = 2.0;
  flight.Run(3.0, watch);
  EXPECT_LT(worst, 0.02);
  EXPECT_EQ(flight.bridge.disagreement(), "");
}

TEST(FcuFrame, NothingOfAFrameGoesOutThatCannotBeCompared) {
  Flight flight;
  flight.TakeOff(6.0);
  const auto sent = [&] {
    const std::string words = flight.bridge.Words();
    return words.substr(words.find(" ms; "));  // how many of each
  };
  flight.link = false;
  flight.Run(0.52);  // its attitude grows old, and a longer cut is another matter
  ++flight.epoch;
  flight.turned = 1.0;
  flight.Run(0.01);
  const std::string before = sent();
  flight.Run(0.15);
  EXPECT_EQ(sent(), before);
  flight.link = true;
  flight.Run(0.1);
  EXPECT_NE(sent(), before);
  EXPECT_EQ(flight.state(), State::kFlying);
  EXPECT_EQ(flight.bridge.disagreement(), "");
}

TEST(FcuFrame, ASetpointOfTheFrameBeforeIsNotSentInTheNewOne) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.setpoints = false;
  flight.epoch = 1;
  flight.turned = 1.0;
  flight.Run(0.02);
  const int sent = flight.px4.seen().setpoints;
  flight.bridge.OnSetpoint(Hover(), flight.now() - 50'000, flight.now());
  flight.Run(0.05);
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
  flight.bridge.OnSetpoint(Hover(), flight.now(), flight.now());
  flight.Run(0.05);
  EXPECT_GT(flight.px4.seen().setpoints, sent);
}

TEST(FcuFrame, OnTheGroundTheAutopilotTakesTheNewFrame) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(5.0);
  flight.epoch = 1;
  flight.turned = 1.0;
  flight.Run(1.0);
  EXPECT_NE(flight.bridge.missing().find("57 degrees off"), std::string::npos)
      << "the stand-in has no estimator: " << flight.bridge.missing();
}

TEST(FcuFrame, SaysInFlightThatTheAttitudesDiffer) {
  Flight flight;
  flight.TakeOff(5.0);
  EXPECT_EQ(flight.bridge.disagreement(), "");
  flight.turned = 0.5;  // in the same frame
  flight.Run(0.2);
  EXPECT_TRUE(Holds(flight.bridge.disagreement(), "degrees off"));
  EXPECT_NE(flight.bridge.Words().find(flight.bridge.disagreement()), std::string::npos);
}

}  // namespace
}  // namespace chase::fcu::testing
