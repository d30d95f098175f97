// The bridge, a stand-in for PX4 and the mission: who lands a flight that mission has not ended.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "common/bus/autopilot_state.h"
#include "test/unit/fcu_flight.h"
#include "test/unit/mission_node_bench.h"

namespace chase::mission {
namespace {

using Fcu = fcu::Handshake::State;

/// The bridge with its autopilot.
class BridgeNode : public bus::Node {
 public:
  BridgeNode(bus::Bus& bus, fcu::testing::Flight* flight) : bus_(bus), flight_(flight) {
    bus.Subscribe<flight_state_t>("FLIGHT_STATE", [flight](const flight_state_t& m) {
      const bool takes_off = m.state == flight_state_t::TAKEOFF;
      flight->bridge.OnFlightState(
          takes_off || m.state == flight_state_t::READY,
          takes_off || m.state == flight_state_t::CHASE || m.state == flight_state_t::SEARCH);
      flight->setpoints = m.state != flight_state_t::IDLE && m.state != flight_state_t::READY;
      flight->motors = m.state != flight_state_t::DONE;  // as control cuts them
    });
  }
  int64_t TickPeriod() const override { return 100'000; }
  void Tick(int64_t /*utime*/) override {
    flight_->Run(1e-6 * static_cast<double>(bus_.Now() - flight_->now()));
  }
  bus::NodeReport Report() const override {
    return {bus::NodeReport::State::kOk, flight_->bridge.Words(), ""};
  }

 private:
  bus::Bus& bus_;
  fcu::testing::Flight* flight_;
};

/// The three of them. Control follows a plan once it is asked to fly and PX4 obeys, or does not say
/// that it stands; and from then on whoever else has the vehicle.
class Flown {
 public:
  Flown() {
    bench_.lockstep.Add(
        "fcu", 0, [this](bus::Bus& bus) { return std::make_unique<BridgeNode>(bus, &flight); });
    control_ = bench_.lockstep.Connect();
    control_->SetIdentity({"control", "", kStart});
    planning_ = bench_.lockstep.Connect();
    planning_->SetIdentity({"planning", "", kStart});
    bench_.lockstep.Add("reader", 0, [this](bus::Bus& bus) {
      bus.Subscribe<status_t>("FCU_STATUS", [this](const auto& m) { autopilot_.Hear(m); });
      return std::make_unique<Silent>();
    });
  }

  void Run(double seconds) {
    for (int i = 0; i < static_cast<int>(10.0 * seconds); ++i) {
      tracking_t tracking{};
      tracking.utime = bench_.lockstep.now();
      const bool asked = !bench_.states.empty() && IsAirborne(static_cast<State>(state()));
      follows_ = follows_ || (asked && !blocked &&
                              (autopilot_.Obeys(tracking.utime) || !autopilot_.IsOnGround()));
      tracking.following = follows_ ? tracking_t::PLAN : tracking_t::NONE;
      control_->Publish("TRACKING", tracking);
      bench_.place = flight.px4.p_WB();
      if (follows_) Plan();
      bench_.Run(0.1);
    }
  }

  void Command(int8_t kind, int64_t id) { bench_.Command(kind, id); }
  int state() const { return bench_.states.back().state; }
  std::string reason() const { return bench_.states.back().reason; }
  bool follows() const { return follows_; }
  /// How often FLIGHT_STATE has told that state.
  int64_t Times(int8_t state) const {
    return std::count_if(bench_.states.begin(), bench_.states.end(),
                         [state](const flight_state_t& m) { return m.state == state; });
  }

  fcu::testing::Flight flight;
  bool blocked = false;  ///< the way up: no plan begins

 private:
  void Plan() {
    plan_t plan{};
    plan.utime = plan.position.utime = bench_.lockstep.now();
    plan.position.duration = 1.0;
    plan.position.n_coefficients = 3;
    plan.position.coefficients = {bench_.place.x() + 5.0, bench_.place.y(), bench_.place.z()};
    plan.target = plan.position;
    plan.yaw = {0.0};
    plan.n_yaw = 1;
    planning_->Publish("PLAN", plan);
  }

  NodeBench bench_;
  std::unique_ptr<bus::Bus> control_, planning_;
  bus::AutopilotState autopilot_;
  bool follows_ = false;
};

/// In CHASE.
class Chase : public Flown {
 public:
  Chase() {
    Run(2.0);
    Command(command_t::TAKEOFF, 1);
    Run(20.0);
    EXPECT_EQ(flight.bridge.handshake().state(), Fcu::kFlying) << flight.bridge.Words();
    Command(command_t::CHASE, 2);
    Run(1.0);
    EXPECT_EQ(state(), +flight_state_t::CHASE) << reason();
    EXPECT_GT(flight.px4.p_WB().z(), 1.0);
  }
};

TEST(MissionFailsafe, AFlightThatTheAutopilotLandsEndsInDone) {
  struct Case {
    const char* what;
    void (*begin)(fcu::testing::Flight*);
    const char* words;
  };
  const Case cases[] = {
      {"battery", [](fcu::testing::Flight* f) { f->px4.SetCharge(0.04); }, "failsafe: "},
      {"link", [](fcu::testing::Flight* f) { f->link = false; }, "failsafe: the link was cut"},
      {"poses", [](fcu::testing::Flight* f) { f->poses = false; }, "done: landed and disarmed"},
      {"pilot", [](fcu::testing::Flight* f) { f->px4.PilotMode(fcu::kLandMode); }, "pilot: "},
  };
  for (const Case& c : cases) {
    Chase chase;
    c.begin(&chase.flight);
    chase.Run(2.0);
    chase.flight.link = true;
    EXPECT_EQ(chase.state(), +flight_state_t::CHASE) << c.what << ": it is in the air";
    chase.Run(15.0);
    EXPECT_FALSE(chase.flight.px4.armed()) << c.what << ": " << chase.flight.bridge.Words();
    EXPECT_EQ(chase.state(), +flight_state_t::DONE) << c.what << ": " << chase.reason();
    EXPECT_EQ(chase.reason().find(std::string("the autopilot has landed and disarmed: ") + c.words),
              0U)
        << c.what << ": " << chase.reason();
  }
}

TEST(MissionFailsafe, ATakeOffThatNeverLeftTheGroundIsNotOver) {
  for (const double silence : {3.5, 6.0}) {
    for (const bool arms : {true, false}) {
      Flown flown;
      flown.flight.px4.options().preflight = "compass";
      flown.Run(2.0);
      flown.Command(command_t::TAKEOFF, 1);
      for (int i = 0; i < 100 && flown.flight.bridge.handshake().state() != Fcu::kArming; ++i)
        flown.Run(0.1);
      ASSERT_EQ(flown.flight.bridge.handshake().state(), Fcu::kArming);
      flown.flight.link = false;
      flown.Run(silence);
      EXPECT_TRUE(flown.follows()) << "control takes it to be in the air";
      flown.flight.link = true;
      flown.Run(3.0);
      if (arms) flown.flight.px4.options().preflight.clear();
      flown.Run(40.0);
      EXPECT_EQ(flown.flight.px4.armed(), arms) << flown.flight.bridge.Words();
      EXPECT_EQ(flown.state(), arms ? +flight_state_t::TAKEOFF : +flight_state_t::READY)
          << silence << " s: " << flown.reason();
      EXPECT_EQ(flown.Times(flight_state_t::DONE), 0) << silence << " s";
      EXPECT_EQ(flown.Times(flight_state_t::HOLD), 0) << silence << " s";
    }
  }
}

// The motors idle until COM_DISARM_PRFLT stops them.
TEST(MissionFailsafe, ATakeOffThatTheAutopilotDisarmsOnTheGroundIsCalledOff) {
  Flown flown;
  flown.blocked = flown.flight.idle = true;
  flown.Run(2.0);
  flown.Command(command_t::TAKEOFF, 1);
  flown.Run(30.0);  // a third of takeoff_patience
  EXPECT_FALSE(flown.flight.px4.armed());
  EXPECT_EQ(flown.state(), +flight_state_t::READY) << flown.reason();
  EXPECT_NE(flown.reason().find("refused: "), std::string::npos) << flown.reason();
}

TEST(MissionFailsafe, AFlightOfOursIsNotOverBeforeItsEnd) {
  Chase chase;
  chase.Run(60.0);
  EXPECT_EQ(chase.state(), +flight_state_t::CHASE) << chase.reason();
  EXPECT_TRUE(chase.flight.px4.armed());
}

}  // namespace
}  // namespace chase::mission
