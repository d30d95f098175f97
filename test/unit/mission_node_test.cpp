#include <gtest/gtest.h>

#include <algorithm>

#include "common/bus/autopilot_state.h"
#include "common/bus/battery.h"
#include "common/world/ages.h"
#include "services/fcu/handshake.h"
#include "test/unit/mission_node_bench.h"

namespace chase::mission {
namespace {

TEST(MissionNode, SaysTenTimesASecondWhereTheFlightIsAndWhatIsMissing) {
  NodeBench bench;
  bench.Run(0.5);
  ASSERT_GE(bench.states.size(), 5u);
  EXPECT_EQ(bench.states.front().state, +flight_state_t::IDLE);
  EXPECT_EQ(bench.states.back().missing,
            (std::vector<std::string>{"prediction is not heard", "planning is not heard",
                                      "control is not heard"}));
  bench.Run(1.5);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  EXPECT_NEAR(static_cast<double>(bench.states.size()), 20.0, 1.0);
  EXPECT_GT(bench.states.back().since, kStart + 1'000'000);
  EXPECT_EQ(bench.states.back().n_missing, 0);
}

TEST(MissionNode, IsReadyAfterTenSweepsInARowForWhichOdometryWasWell) {
  NodeBench bench;
  bench.Run(2.0);
  ASSERT_EQ(bench.states.back().state, +flight_state_t::READY);
  bench.health = pose_t::HEALTH_DEGRADED;
  bench.Run(0.2);
  bench.health = pose_t::HEALTH_OK;
  bench.Run(0.12);
  ASSERT_EQ(bench.states.back().n_missing, 1);
  EXPECT_NE(bench.states.back().missing[0].find("of 10 good sweeps in a row"), std::string::npos);
  bench.Run(0.2);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  bench.n_cut = 1;
  bench.Run(0.5);
  ASSERT_EQ(bench.states.back().n_missing, 1);
  EXPECT_NE(bench.states.back().missing[0].find("OBSTACLES"), std::string::npos);
}

TEST(MissionNode, AnswersACommandAndSaysTheNewStateAtOnce) {
  NodeBench bench;
  bench.Run(2.0);
  const size_t before = bench.states.size();
  bench.Command(command_t::CHASE, 1);
  ASSERT_EQ(bench.acks.size(), 1u);
  EXPECT_EQ(bench.acks[0].verdict, +command_ack_t::REFUSED);
  EXPECT_NE(bench.acks[0].reason.find("take off first"), std::string::npos);
  bench.Command(command_t::TAKEOFF, 2);
  bench.Command(command_t::TAKEOFF, 2);
  ASSERT_EQ(bench.acks.size(), 3u);
  EXPECT_EQ(bench.acks[1].verdict, +command_ack_t::ACCEPTED);
  EXPECT_EQ(bench.acks[1].command_sender, "command");
  EXPECT_EQ(bench.acks[1].command_start, kStart);
  EXPECT_EQ(bench.acks[1].id, 2);
  EXPECT_EQ(bench.acks[2].verdict, +command_ack_t::ACCEPTED) << "the same answer again";
  EXPECT_GT(bench.states.size(), before);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::TAKEOFF);
  EXPECT_EQ(bench.states.back().has_home, 1);
}

TEST(MissionNode, TellsTheGeofenceInTheFrameWOnceItHasTakenOff) {
  MissionConfig config;
  config.geofence.polygon = {{-5, -5}, {5, -5}, {0, 5}};
  NodeBench bench(config), free;
  bench.place = {10, 20, 0.5};
  bench.Run(2.0);
  EXPECT_TRUE(bench.fences.empty());
  bench.Command(command_t::TAKEOFF, 1);
  bench.Run(3.0);
  ASSERT_GE(bench.fences.size(), 2u);
  const geofence_t& fence = bench.fences.back();
  EXPECT_EQ(fence.corners, (std::vector<double>{5, 15, 15, 15, 10, 25}));
  EXPECT_EQ(fence.floor, -0.5);
  EXPECT_EQ(fence.ceiling, 30.5);
  free.Run(2.0);
  free.Command(command_t::TAKEOFF, 1);
  free.Run(2.0);
  EXPECT_TRUE(free.fences.empty());
}

TEST(MissionNode, StartedInFlightItHearsFromControlWhereItTookOff) {
  NodeBench bench;
  const auto control = bench.lockstep.Connect();
  control->SetIdentity({"control", "", kStart});
  tracking_t tracking{};
  tracking.utime = kStart;
  tracking.following = tracking_t::PLAN;
  control->Publish("TRACKING", tracking);
  bench.Run(1.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::HOLD);
  EXPECT_EQ(bench.states.back().has_home, 0);
  flight_state_t home{};
  home.utime = kStart;
  home.has_home = 1;
  home.state = flight_state_t::HOLD;
  home.since = kStart - 5'000'000;
  home.reason = "stop commanded";
  bus::Set(home.home, Eigen::Vector3d(1, 2, 3));
  control->Publish("HOME", home);
  bench.Run(0.5);
  EXPECT_EQ(bench.states.back().has_home, 1);
  EXPECT_EQ(bus::ToVector(bench.states.back().home), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(bench.states.back().since, home.since);
  EXPECT_EQ(bench.states.back().reason, "stop commanded: before this process started");
}

// Without a pose control tells nothing of itself after 2 s: HOME alone is left.
TEST(MissionNode, AnEmergencyOutlivesItsProcess) {
  NodeBench bench;
  const auto control = bench.lockstep.Connect();
  control->SetIdentity({"control", "", kStart});
  flight_state_t led{};
  const auto run = [&](double seconds) {
    for (int i = 0; i < std::lround(10.0 * seconds); ++i) {
      bench.Run(0.1);
      if (bench.states.empty()) continue;
      if (bench.states.back().has_home != 0) led = bench.states.back();
      if (bench.states.back().has_home == 0 && led.has_home != 0) control->Publish("HOME", led);
    }
  };
  bench.Run(1.5);
  bench.Command(command_t::TAKEOFF, 1);
  bench.health = pose_t::HEALTH_LOST;
  run(2.5);
  ASSERT_EQ(led.state, +flight_state_t::EMERGENCY);
  const int64_t since = led.since;
  bench.lockstep.Kill("mission");
  run(0.5);
  bench.lockstep.Start("mission");
  run(0.3);
  const size_t heard = bench.states.size();
  run(10.0);
  for (size_t i = heard; i < bench.states.size(); ++i) {
    EXPECT_EQ(bench.states[i].state, +flight_state_t::EMERGENCY) << i - heard;
    EXPECT_EQ(bench.states[i].since, since);
  }
  bench.health = pose_t::HEALTH_OK;
  run(0.2);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::HOLD);
}

TEST(MissionNode, LooksForATargetThatIsForecastNoMore) {
  NodeBench bench;
  bench.forecasts = true;
  bench.Run(1.5);
  bench.Command(command_t::TAKEOFF, 1);
  bench.Command(command_t::CHASE, 2);
  bench.Run(2.0);
  ASSERT_EQ(bench.states.back().state, +flight_state_t::CHASE) << bench.states.back().reason;
  bench.forecasts = false;
  bench.Run(1.7);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::SEARCH);
  bench.forecasts = true;
  bench.Run(0.2);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::CHASE);
}

TEST(MissionNode, AnswersWhatItWasGivenBeforeItsStartWithoutKnowing) {
  NodeBench bench;
  bench.Run(2.0);
  bench.lockstep.Kill("mission");
  bench.Run(0.5);
  command_t m{};
  m.utime = bench.lockstep.now();
  m.kind = command_t::TAKEOFF;
  bench.Run(0.5);
  bench.lockstep.Start("mission");
  bench.Run(0.5);
  const auto chase_command = bench.lockstep.Connect();
  chase_command->SetIdentity({"command", "", kStart});
  chase_command->Publish("COMMAND", m);
  bench.Run(0.1);
  ASSERT_EQ(bench.acks.size(), 1u);
  EXPECT_EQ(bench.acks[0].verdict, +command_ack_t::UNKNOWN);
  EXPECT_NE(bench.acks[0].reason.find("given before the mission process started, now "),
            std::string::npos)
      << bench.acks[0].reason;
}

TEST(MissionNode, LeavesTheTargetsChoiceToPerception) {
  NodeBench bench;
  bench.Run(2.0);
  bench.Command(command_t::SELECT, 1);
  EXPECT_TRUE(bench.acks.empty());
}

TEST(MissionNode, KeepsWhatPerceptionWasTold) {
  NodeBench bench;
  std::vector<selection_t> kept;
  const auto perception = bench.lockstep.Connect();
  bench.lockstep.Add("reader", 0, [&kept](bus::Bus& bus) {
    bus.Subscribe<selection_t>("SELECTION_KEPT", [&kept](const auto& m) { kept.push_back(m); });
    return std::make_unique<Silent>();
  });
  selection_t selection{};
  selection.utime = kStart;
  selection.hue_max = 90.0;
  perception->SetIdentity({"prediction", "", kStart});
  perception->Publish("SELECTION", selection);
  bench.Run(2.0);
  EXPECT_TRUE(kept.empty()) << "not perception's";
  for (const double hue : {100.0, 120.0}) {
    selection.hue_max = hue;
    perception->SetIdentity({"perception", "", kStart});
    perception->Publish("SELECTION", selection);
    bench.Run(3.0);
    ASSERT_FALSE(kept.empty());
    EXPECT_EQ(kept.back().hue_max, hue);
  }
  EXPECT_EQ(kept.size(), 6U) << "once a second";
  EXPECT_GT(kept.back().utime, kStart + 7'000'000);
}

TEST(MissionNode, CommandsToOtherVehiclesAreNotItsOwn) {
  NodeBench bench;
  bench.Run(2.0);
  bench.Command(command_t::TAKEOFF, 1, "eagle");
  EXPECT_TRUE(bench.acks.empty());
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  EXPECT_EQ(bench.lockstep.bus("mission").counters().at("COMMAND").foreign, 1);
}

TEST(Battery, IsReadBehindTheAutopilotsOwnWords) {
  status_t status{};
  status.name = "fcu";
  status.detail = "failsafe: Critical battery, Failsafe activated; POSCTL, armed, battery 7 %";
  EXPECT_EQ(bus::BatteryIn(status), 0.07);
  status.detail = "failsafe: low battery level";
  EXPECT_FALSE(bus::BatteryIn(status));
}

TEST(AutopilotState, ReadsHandOversInTheBridgesOwnWords) {
  using fcu::Handshake;
  using Fcu = Handshake::State;
  status_t status{};
  status.utime = kStart;
  status.name = "fcu";
  bus::AutopilotState autopilot;
  EXPECT_EQ(autopilot.words(), "");
  for (const Fcu state : {Fcu::kPilot, Fcu::kFailsafe, Fcu::kLanding, Fcu::kDone, Fcu::kRefused}) {
    const std::string head = Handshake::Name(state) + ": setpoints have ceased: it lands";
    status.detail = head + "; mode POSCTL, armed, in air, battery 70 %";
    autopilot.Hear(status);
    EXPECT_TRUE(autopilot.IsHandedOver());
    EXPECT_EQ(autopilot.words(), head);
  }
  for (const char* ours :
       {"flying: armed and in OFFBOARD", "standby: the pilot may give it back",
        "no autopilot heard on udp", "no autopilot: no heartbeat of a PX4 yet"}) {
    status.detail = std::string(ours) + "; mode OFFBOARD, armed, in air";
    autopilot.Hear(status);
    EXPECT_FALSE(autopilot.IsHandedOver()) << ours;
    EXPECT_EQ(autopilot.words(), ours);
  }
  status.name = "planning";
  status.detail = "done: landed; mode OFFBOARD, disarmed, on ground";
  autopilot.Hear(status);
  EXPECT_FALSE(autopilot.IsHandedOver());
}

TEST(AutopilotState, StandsOnTheGroundUntilItSaysOtherwise) {
  status_t status{};
  status.utime = kStart;
  status.name = "fcu";
  bus::AutopilotState autopilot;
  const auto hear = [&](const char* detail) {
    status.detail = detail;
    autopilot.Hear(status);
    return autopilot.IsOnGround();
  };
  EXPECT_TRUE(hear("standby: a PX4 is heard; mode POSCTL, disarmed, on ground"));
  EXPECT_TRUE(hear("no autopilot: the autopilot's heartbeat has ceased"));
  EXPECT_FALSE(autopilot.Obeys(kStart + 100'000'000)) << "it is on the ground still";
  EXPECT_FALSE(hear("flying: armed; mode OFFBOARD, armed, in air"));
  EXPECT_FALSE(hear("no autopilot: the autopilot's heartbeat has ceased"));
}

TEST(AutopilotState, TellsWhetherItStandsDisarmed) {
  struct Case {
    const char* words;
    bool disarmed, armed;
  };
  const Case cases[] = {
      {"flying: armed; mode OFFBOARD, armed, on ground, battery 70 %", false, true},
      {"pilot: the pilot has it; mode POSCTL, armed, in air", false, true},
      {"standby: a PX4 is heard; mode POSCTL, disarmed, on ground, battery 70 %", true, false},
      {"done: landed and disarmed; mode AUTO.LAND, disarmed, on ground", true, false},
      {"failsafe: it has disarmed; mode AUTO.LAND, disarmed, in air", false, false},
      {"standby: a PX4 is heard; mode POSCTL, disarmed, unknown", false, false},
      {"no autopilot: the autopilot's heartbeat has ceased", false, false},
      {"failsafe: it said Landed, disarmed, on ground", false, false},
      {"failsafe: it said Landed; mode X, disarmed, on ground; mode OFFBOARD, armed, in air", false,
       true},
      {"failsafe: it said Up; mode X, armed, in air; mode OFFBOARD, disarmed, on ground", true,
       false},
  };
  status_t status{};
  status.utime = kStart;
  status.name = "fcu";
  bus::AutopilotState autopilot;
  EXPECT_FALSE(autopilot.disarmed()) << "nobody has told";
  for (const bool disarmed_before : {false, true}) {
    for (const Case& c : cases) {
      status.detail = disarmed_before ? cases[2].words : cases[0].words;
      autopilot.Hear(status);
      status.utime += 1'000'000;
      status.detail = c.words;
      autopilot.Hear(status);
      EXPECT_EQ(autopilot.disarmed(), c.disarmed ? std::optional(status.utime) : std::nullopt)
          << c.words;
      EXPECT_EQ(autopilot.IsArmed(), c.armed) << c.words;
    }
  }
}

TEST(MissionNode, SaysWhoElseFlies) {
  struct Bridge : bus::Node {
    explicit Bridge(const std::string& said) : detail(said) {}
    bus::NodeReport Report() const override { return {bus::NodeReport::State::kOk, detail}; }
    const std::string& detail;
  };
  std::string words = "pilot: the pilot has it; mode POSCTL, armed, on ground";
  NodeBench bench;
  bench.lockstep.Add("fcu", 0, [&](bus::Bus&) { return std::make_unique<Bridge>(words); });
  bench.Run(2.0);
  EXPECT_EQ(bench.states.back().reason.find("pilot"), std::string::npos) << "on the ground";
  EXPECT_EQ(bench.states.back().n_missing, 0);
  bench.Command(command_t::TAKEOFF, 1);
  bench.Run(0.2);
  EXPECT_EQ(bench.states.back().reason, "take-off commanded; fcu: pilot: the pilot has it");
}

TEST(MissionNode, ATakeOffThatTheAutopilotRefusesEndsOnTheGroundInItsWords) {
  struct Bridge : bus::Node {
    bus::NodeReport Report() const override {
      return {bus::NodeReport::State::kDegraded,
              "refused: arming was refused; mode OFFBOARD, disarmed, on ground"};
    }
  };
  NodeBench bench;
  bench.lockstep.Add("fcu", 0, [](bus::Bus&) { return std::make_unique<Bridge>(); });
  bench.Run(2.0);
  bench.Command(command_t::TAKEOFF, 1);
  bench.Run(2.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::TAKEOFF);
  bench.Run(1.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  EXPECT_EQ(bench.states.back().reason, "take-off called off; fcu: refused: arming was refused");
}

TEST(MissionNode, IsReadyOnceABatteryIsToldOf) {
  struct Bridge : bus::Node {
    explicit Bridge(const char* said) : detail(said) {}
    bus::NodeReport Report() const override { return {bus::NodeReport::State::kOk, detail}; }
    const char* detail;
  };
  for (const char* words : {"standby: ready; battery 80 %", "standby: ready", ""}) {
    NodeBench bench({}, true);
    if (*words != '\0')
      bench.lockstep.Add("fcu", 0, [words](bus::Bus&) { return std::make_unique<Bridge>(words); });
    bench.Run(2.0);
    const bool told = std::string(words).find("battery") != std::string::npos;
    EXPECT_EQ(bench.states.back().state, told ? +flight_state_t::READY : +flight_state_t::IDLE);
    if (!told) {
      EXPECT_EQ(bench.states.back().missing.at(0),
                "the battery's charge is not known: FCU_STATUS does not tell it");
    }
  }
}

TEST(MissionNode, HealthCountsTheLivesOfEveryProcess) {
  NodeBench bench;
  bench.Run(3.0);
  const auto find = [&](const std::string& name) {
    for (const process_health_t& p : bench.healths.back().processes)
      if (p.name == name) return p;
    return process_health_t{};
  };
  EXPECT_EQ(bench.healths.back().n_processes, 4);  // and mission itself
  EXPECT_EQ(find("mission").name, "mission");
  EXPECT_EQ(find("planning").restarts, 0);
  EXPECT_LE(find("planning").age, 1.1);
  bench.lockstep.Kill("planning");
  bench.Run(3.0);
  EXPECT_GT(find("planning").age, 2.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::IDLE);
  EXPECT_EQ(bench.states.back().missing.at(0).rfind("planning is", 0), 0u);
  bench.lockstep.Start("planning");
  bench.Run(3.0);
  EXPECT_EQ(find("planning").restarts, 1);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
}

TEST(MissionNode, WhoIsNeededAndWasNeverHeardIsInHealth) {
  NodeBench bench;
  bench.lockstep.Kill("control");
  bench.Run(3.0);
  const auto& rows = bench.healths.back().processes;
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0].name, "control");
  EXPECT_EQ(rows[0].age, -1.0);
  EXPECT_EQ(rows[0].state, +status_t::FAILED);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end(),
                             [](const auto& a, const auto& b) { return a.name < b.name; }));
}

TEST(MissionNode, ThatBeganAnewInFlightCountsItsOwnReturnAndThoseSince) {
  NodeBench bench;
  bench.Run(2.0);
  const int64_t since = bench.lockstep.now();  // another mission process led from here on
  bench.Run(1.0);
  for (const char* name : {"mission", "planning"}) bench.lockstep.Kill(name);
  bench.Run(0.5);
  for (const char* name : {"mission", "planning"}) bench.lockstep.Start(name);
  bench.Run(0.5);
  const auto control = bench.lockstep.Connect();
  control->SetIdentity({"control", "", kStart});
  flight_state_t home{};
  home.utime = bench.lockstep.now();
  home.since = since;
  home.has_home = 1;
  control->Publish("HOME", home);
  bench.Run(2.5);
  for (const process_health_t& p : bench.healths.back().processes)
    EXPECT_EQ(p.restarts, p.name == "mission" || p.name == "planning" ? 1 : 0) << p.name;
}

TEST(MissionNode, WhoLooksOnIsInHealthAndNeededForNothing) {
  NodeBench bench;
  for (const char* name : {"viewer", "link", "recorder"})
    bench.lockstep.Add(name, 0, [](bus::Bus&) { return std::make_unique<Silent>(); });
  bench.Run(2.5);
  EXPECT_EQ(bench.healths.back().n_processes, 7);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  for (const char* name : {"viewer", "link"}) bench.lockstep.Kill(name);
  bench.Run(4.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::READY);
  for (const process_health_t& p : bench.healths.back().processes)
    EXPECT_EQ(p.age > world::kMostAge.status, p.name == "viewer" || p.name == "link") << p.name;
  bench.lockstep.Kill("recorder");
  bench.Run(4.0);
  EXPECT_EQ(bench.states.back().state, +flight_state_t::IDLE);
}

}  // namespace
}  // namespace chase::mission
