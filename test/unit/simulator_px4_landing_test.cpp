#include <gtest/gtest.h>

#include "common/mavlink/px4_mode.h"
#include "simulator_px4_link.h"

namespace chase::simulator::testing {
namespace {

/// Armed at rest on the ground, led by attitude.
LandDetector::Inputs AtRest() {
  return {0, true, false, false, 0.0, 0.5, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
}

/// Does it call itself landed after so many seconds, having flown before?
bool Lands(LandDetector::Inputs in, double seconds) {
  LandDetector detector;
  LandDetector::Inputs flies = in;
  flies.throttle = 0.5;
  for (; flies.utime < 1'000'000; flies.utime += 10'000) EXPECT_FALSE(detector.Update(flies));
  bool landed = false;
  for (in.utime = 1'000'000; 1e-6 * static_cast<double>(in.utime) < 1.0 + seconds;
       in.utime += 10'000)
    landed = detector.Update(in);
  return landed;
}

TEST(Px4Landing, TakesASecondOfLittleThrottleAndNoMotion) {
  LandDetector::Inputs in = AtRest();
  EXPECT_FALSE(Lands(in, 0.9));
  EXPECT_TRUE(Lands(in, 1.1));
  in.throttle = 0.09;
  EXPECT_TRUE(Lands(in, 1.1));
  in.throttle = 0.1;
  EXPECT_FALSE(Lands(in, 60.0)) << "control's least thrust in flight";
  in = AtRest();
  in.v_WB.z() = -0.3;
  EXPECT_FALSE(Lands(in, 60.0)) << "it sinks";
  in = AtRest();
  in.v_WB.x() = 1.6;
  EXPECT_FALSE(Lands(in, 60.0));
  in = AtRest();
  in.w_WB_B.y() = 0.4;
  EXPECT_FALSE(Lands(in, 60.0));
}

TEST(Px4Landing, InItsOwnModesItHasToDescend) {
  LandDetector::Inputs in = AtRest();
  in.controls_climb = true;
  in.throttle = 0.15;
  EXPECT_FALSE(Lands(in, 60.0));
  in.descends = true;
  EXPECT_TRUE(Lands(in, 1.1));
  in.throttle = 0.2;
  EXPECT_FALSE(Lands(in, 60.0));
}

/// Armed in OFFBOARD by a stream of this throttle: for how long, s, at most 30?
double StaysArmed(Link* link, float throttle) {
  link->Setpoints(150, 10'000, throttle);
  EXPECT_EQ(link->Order(mav::MavCmd::DO_SET_MODE, 1, 6), mav::MavResult::ACCEPTED);
  EXPECT_EQ(link->Order(mav::MavCmd::COMPONENT_ARM_DISARM, 1, 0), mav::MavResult::ACCEPTED);
  int sent = 0;
  for (; sent < 3000 && link->px4().armed(); ++sent) link->Setpoints(1, 10'000, throttle);
  return 0.01 * sent;
}

TEST(Px4Landing, DisarmsWhereNobodyTakesOff) {
  Link idle, flies;
  EXPECT_NEAR(StaysArmed(&idle, 0.05f), 10.0, 0.2) << "COM_DISARM_PRFLT";
  EXPECT_EQ(StaysArmed(&flies, 0.1f), 30.0) << "it takes itself to have taken off";
  EXPECT_FALSE(flies.px4().landed());
  EXPECT_EQ(flies.Order(mav::MavCmd::COMPONENT_ARM_DISARM, 0, 0),
            mav::MavResult::TEMPORARILY_REJECTED);
}

}  // namespace
}  // namespace chase::simulator::testing
