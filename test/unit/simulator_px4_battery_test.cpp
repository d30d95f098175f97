#include <gtest/gtest.h>

#include "simulator_px4_link.h"

namespace chase::simulator::testing {
namespace {

// Commander publishes a failsafe for a warning, too, and until its cause has gone.
TEST(Px4, CallsItselfCriticalWhileTheCauseOfAFailsafeLasts) {
  Link link;
  link.Fly();
  EXPECT_EQ(link.Status(), mav::MavState::ACTIVE);
  link.body.charge = 0.1;
  EXPECT_EQ(link.Status(), mav::MavState::CRITICAL) << "a warning";
  EXPECT_TRUE(link.px4().mode() == mavlink::kPositionMode);
  link.body.charge = 0.04;
  EXPECT_EQ(link.Status(), mav::MavState::CRITICAL);
  EXPECT_TRUE(link.px4().mode() == mavlink::kLandMode);
  link.px4().PilotMode(mavlink::kPositionMode);
  EXPECT_EQ(link.Status(), mav::MavState::CRITICAL) << "the pilot has it, the battery is empty";
  EXPECT_TRUE(link.px4().mode() == mavlink::kPositionMode);
  link.px4().PilotArms(false);
  EXPECT_EQ(link.Status(), mav::MavState::STANDBY);
}

/// The mode that it is in a moment after the charge has become `charge`.
mavlink::Mode ModeAt(double charge, Link* link) {
  link->body.charge = charge;
  link->Seconds(0.1);
  return link->px4().mode();
}

// COM_LOW_BAT_ACT 3 returns at BAT_CRIT_THR; without a position on the globe it lands there.
TEST(Px4, LandsAtTheChargeThatItsParametersSay) {
  for (const double critical : {0.07, 0.12}) {
    Link link;
    link.px4().options().bat_crit_thr = critical;
    link.Fly();
    EXPECT_TRUE(ModeAt(critical + 0.01, &link) == mavlink::kPositionMode) << critical;
    EXPECT_TRUE(ModeAt(critical - 0.01, &link) == mavlink::kLandMode) << critical;
    link.px4().PilotMode(mavlink::kPositionMode);
    EXPECT_TRUE(ModeAt(0.055, &link) == mavlink::kPositionMode) << "the pilot has it";
    EXPECT_TRUE(ModeAt(0.04, &link) == mavlink::kLandMode) << "worse than when he took it";
  }
}

// COM_LOW_BAT_ACT 0, as PX4 has it.
TEST(Px4, OnlyWarnsOfAnEmptyBatteryWhereItsParametersSaySo) {
  Link link;
  link.px4().options().low_battery_lands = false;
  link.Fly();
  EXPECT_TRUE(ModeAt(0.01, &link) == mavlink::kPositionMode);
  EXPECT_EQ(link.Status(), mav::MavState::CRITICAL);
  link.px4().PilotArms(false);
  EXPECT_EQ(link.Command(mav::MavCmd::COMPONENT_ARM_DISARM, 1.0f, 0.0f),
            mav::MavResult::TEMPORARILY_REJECTED);
}

TEST(Px4, ArmsUntilTheBatteryIsCritical) {
  for (const double charge : {0.08, 0.06}) {
    Link link;
    link.body.charge = charge;
    link.Seconds(0.1);
    EXPECT_EQ(link.Command(mav::MavCmd::COMPONENT_ARM_DISARM, 1.0f, 0.0f),
              charge > 0.07 ? mav::MavResult::ACCEPTED : mav::MavResult::TEMPORARILY_REJECTED);
  }
}

}  // namespace
}  // namespace chase::simulator::testing
