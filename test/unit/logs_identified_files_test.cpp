#include <gtest/gtest.h>

#include <cmath>

#include "common/config/checksum.h"
#include "logs/src/identified_files.h"
#include "logs/src/identify.h"
#include "services/fcu/conversions.h"
#include "test/unit/logs_flown.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

using namespace testing;

/// What a motor that gives `body`'s thrust by the curve of `flown` gives for a thrust that `config`
/// asks for, over that thrust.
double Given(const Body& body, const fcu::FcuConfig& flown, const fcu::FcuConfig& config,
             double thrust) {
  const auto share = [](double u, double c) { return c * u * u + (1.0 - c) * u; };
  const double u = fcu::ThrustShare(thrust, config.hover_thrust, config.motor_curve);
  const double believed = 9.81 * share(u, flown.motor_curve) /
                          share(flown.hover_thrust, flown.motor_curve);  // by `flown`
  return believed * (1.0 + body.thrust_error + body.thrust_curve * (believed / 9.81 - 1.0)) /
         thrust;
}

Identification Flown(const Body& body) {
  Errors errors;
  errors.accel = 0.03, errors.gyro = 0.003, errors.velocity = 0.005;
  return Identify(Fly(body, Course(), errors, 1)).value();
}

TEST(IdentifiedFiles, TheBridgesThrustIsWhatIsAskedFor) {
  for (const double curve : {0.0, 0.1}) {
    for (const double motor_curve : {0.0, 0.6}) {
      Body body;
      body.thrust_error = -0.1, body.thrust_curve = curve;
      fcu::FcuConfig flown;
      flown.motor_curve = motor_curve;
      fcu::FcuConfig config = flown;
      EXPECT_EQ(SetInFcu(Flown(body), &config).size(), 2u);
      EXPECT_EQ(config.Problem(), "");
      for (const double share : {0.8, 1.0, 1.2}) {
        EXPECT_GT(std::abs(Given(body, flown, flown, 9.81 * share) - 1.0), 0.07) << curve;
        EXPECT_NEAR(Given(body, flown, config, 9.81 * share), 1.0, 0.015)
            << curve << motor_curve << share;
      }
    }
  }
}

TEST(IdentifiedFiles, TheServicesReadWhatTheFlightShowsAndAllElseStays) {
  Body body;
  body.drag = 0.6, body.thrust_error = -0.1, body.thrust_curve = 0.1;
  const Identification found = Flown(body);
  const std::string folder = Temp("update");
  fs::create_directory(folder);
  const std::string control = folder + "/control.yaml", fcu = folder + "/fcu.yaml";
  const std::string planning = folder + "/planning.yaml";
  std::ofstream(planning) << "planner:\n  drag: 0.2  # as control's\n  max_speed: 3\n";
  std::ofstream(control) << "# Of ours.\ndrag: [0.2, 0.2, 0.3]  # the x500's\n#lead: 0\n";
  std::ofstream(fcu) << "link: /dev/ttyAMA0  # TELEM 2\n#hover_thrust: 0.5  # MPC_THR_HOVER\n";
  fcu::FcuConfig flown;
  config::Load(fcu, &flown);
  const std::string sum = std::to_string(config::Checksum(config::Dump(flown)));

  EXPECT_NE(ErrorOf([&] { UpdateFiles(found, "1", folder); }).find("put back the file that flew"),
            std::string::npos);
  EXPECT_EQ(ReadText(control).find("by chase-log"), std::string::npos) << "nothing is written then";
  EXPECT_NE(ReadText(planning).find("  drag: 0.2  #"), std::string::npos);

  const std::string said = UpdateFiles(found, sum, folder);
  EXPECT_NE(said.find("fcu.yaml: hover_thrust: 0.5"), std::string::npos) << said;
  control::ControlConfig follows;
  config::Load(control, &follows);
  EXPECT_NEAR(follows.drag.x(), 0.6, 0.02);
  EXPECT_NEAR(follows.drag.z(), 0.6, 0.05);
  planning::PlanningConfig leans;
  config::Load(planning, &leans);
  EXPECT_EQ(leans.planner.drag, follows.drag.x());
  EXPECT_EQ(leans.planner.max_speed, 3.0);
  EXPECT_NE(ReadText(planning).find("  # as control's\n  max_speed: 3\n"), std::string::npos);
  EXPECT_NE(said.find("planning.yaml: planner.drag: 0."), std::string::npos) << said;
  EXPECT_EQ(ReadText(control).rfind("# Of ours.\ndrag: [", 0), 0u) << ReadText(control);
  EXPECT_NE(ReadText(control).find("]  # the x500's\n#lead: 0\nlead: "), std::string::npos);
  fcu::FcuConfig curve;
  config::Load(fcu, &curve);
  EXPECT_EQ(curve.link, "/dev/ttyAMA0");
  EXPECT_NEAR(Given(body, flown, curve, 9.81), 1.0, 0.01);
  EXPECT_EQ(ReadText(fcu).rfind("link: /dev/ttyAMA0  # TELEM 2\n#hover_thrust: 0.5  # MPC_THR", 0),
            0u)
      << ReadText(fcu);
  EXPECT_NE(ErrorOf([&] { UpdateFiles(found, sum, folder); }).find("has cksum"), std::string::npos)
      << "its thrust would be counted twice";
}

TEST(IdentifiedFiles, PlanningLeansAgainstTheDragThatControlFeedsForward) {
  Body body;
  body.drag = 0.6;
  const Identification found = Flown(body);
  const std::string folder = Temp("planning");
  fs::create_directory(folder);
  const std::string file = folder + "/planning.yaml";
  const auto updated = [&](const std::string& text) {
    std::ofstream(file) << text;
    UpdateFiles(found, "", folder);
    planning::PlanningConfig plans;
    control::ControlConfig follows;
    config::Load(file, &plans);
    config::Load(folder + "/control.yaml", &follows);
    EXPECT_EQ(plans.planner.drag, follows.drag.x()) << text;
    EXPECT_NEAR(plans.planner.drag, 0.6, 0.02) << text;
    return ReadText(file);
  };
  // What stands before the drag's line, its old one if any, and what stands behind.
  struct Case {
    std::string head, old, tail;
  };
  const Case cases[] = {
      {"", "", ""},
      {"horizon: 3\nplanner:\n", "", ""},
      {"planner:\n", "", "  max_speed: 2  # m/s\n\n# Landing\nlanding_room: 0.5\n"},
      {"planner:\n    max_speed: 2\n", "    drag: 0.3\n", "    z_max: 2\nhorizon: 3\n"},
      {"horizon: 3\nplanner:  # of Problem 2\n  sigmas: 2\n#  drag: 0.25  # 1/s\n", "",
       "  max_speed: 2\n"},
  };
  for (const auto& [head, old, tail] : cases) {
    const std::string text = updated(head + old + tail);
    const std::string before = head.empty() ? "planner:\n" : head;
    EXPECT_EQ(text.rfind(before, 0), 0u) << text;
    const std::string line =
        text.substr(before.size(), text.find('\n', before.size()) + 1 - before.size());
    EXPECT_NE(line.find(" drag: 0."), std::string::npos) << text;
    EXPECT_NE(line.find("  # by chase-log identify: 1/s, +- "), std::string::npos) << text;
    EXPECT_EQ(text.substr(before.size() + line.size()), tail);
    EXPECT_EQ(updated(text), text) << "its own line is written anew";
  }

  // As it is installed, all commented out.
  std::string installed, line;
  std::istringstream lines(config::Dump(planning::PlanningConfig()));
  while (std::getline(lines, line)) installed += "#" + line + "\n";
  const std::string text = updated(installed);
  EXPECT_NE(text.find("#planner:  # of Problem 2\nplanner:\n#  degree: "), std::string::npos)
      << text;
  EXPECT_NE(text.find("\n#  drag: 0.25  # "), std::string::npos);
  EXPECT_NE(text.find("1/s\n  drag: 0."), std::string::npos) << text;

  for (const std::string refused : {"planner: {max_speed: 2}\n", "planner:\n  'drag': 0.3\n"}) {
    std::ofstream(file) << refused;
    EXPECT_NE(ErrorOf([&] { UpdateFiles(found, "", folder); }), "") << refused;
    EXPECT_EQ(ReadText(file), refused);
  }
}

TEST(IdentifiedFiles, AFlightThatDoesNotShowTheThrustLeavesTheBridgesFile) {
  Identification found = Flown(Body());
  found.thrust_scale.sigma = INFINITY;
  const std::string folder = Temp("no_thrust");
  fs::create_directory(folder);
  const std::string sum = std::to_string(config::Checksum(config::Dump(fcu::FcuConfig())));
  const std::string said = UpdateFiles(found, sum, folder);
  EXPECT_NE(said.find(folder + "/fcu.yaml: stays, the flight does not show the thrust\n"),
            std::string::npos)
      << said;
  EXPECT_TRUE(fs::exists(folder + "/control.yaml"));
  EXPECT_FALSE(fs::exists(folder + "/fcu.yaml"));
}

TEST(IdentifiedFiles, AFileKeepsItsPermissionsAndALinkStaysOne) {
  const Identification found = Flown(Body());
  const std::string folder = Temp("linked"), kept = Temp("kept");
  fs::create_directory(folder);
  fs::create_directory(kept);
  const std::string control = folder + "/control.yaml", fcu = folder + "/fcu.yaml";
  std::ofstream(kept + "/control.yaml") << "lead: 0\n";
  fs::create_symlink(kept + "/control.yaml", control);
  std::ofstream(fcu) << "link: /dev/ttyAMA0\n";
  fcu::FcuConfig flown;
  config::Load(fcu, &flown);
  const auto ours = fs::perms::owner_read | fs::perms::owner_write;
  fs::permissions(fcu, ours);
  fs::permissions(kept + "/control.yaml", ours | fs::perms::group_read);
  UpdateFiles(found, std::to_string(config::Checksum(config::Dump(flown))), folder);
  EXPECT_EQ(fs::status(fcu).permissions(), ours);
  EXPECT_NE(ReadText(fcu).find("hover_thrust: "), std::string::npos);
  EXPECT_TRUE(fs::is_symlink(control));
  EXPECT_EQ(fs::status(control).permissions(), ours | fs::perms::group_read);
  EXPECT_NE(ReadText(kept + "/control.yaml").find("drag: "), std::string::npos);
}

TEST(IdentifiedFiles, WithoutTheBridgeItsFileStays) {
  const Identification found = Flown(Body());
  const std::string folder = Temp("no_bridge");
  EXPECT_NE(ErrorOf([&] { UpdateFiles(found, "", folder); }).find("no folder"), std::string::npos);
  fs::create_directory(folder);
  EXPECT_NE(UpdateFiles(found, "", folder).find("fcu.yaml: stays"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder + "/control.yaml"));
  EXPECT_FALSE(fs::exists(folder + "/fcu.yaml"));
  EXPECT_NE(ErrorOf([&] { UpdateFiles({}, "", folder); }).find("shows nothing"), std::string::npos);
}

}  // namespace
}  // namespace chase::logs
