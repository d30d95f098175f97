#include <gtest/gtest.h>

#include <set>

#include "common/world/random.h"
#include "fcu_engaged.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

bool Latched(State s) {
  return s == State::kDone || s == State::kPilot || s == State::kFailsafe || s == State::kRefused;
}

bool IsArm(const mav::CommandLong& m) { return m.command == 400 && m.param1 > 0.5f; }
bool IsOffboard(const mav::CommandLong& m) {
  return m.command == 176 && m.param1 == 1.0f && m.param2 == 6.0f;  // 1: a mode of PX4's own
}

/// Facts that change by themselves at random: any order of inputs.
class Chaos {
 public:
  explicit Chaos(uint64_t seed) : random_(seed) {
    facts_.utime = kStart;
    facts_.mode = kPosition;
  }
  const Facts& Next() {
    facts_.utime += kTick;
    if (random_.Next() % 50 != 0) return facts_;
    facts_.told = facts_.utime;
    switch (random_.Next() % 10) {
      case 0:
        facts_.heard = random_.Next() % 4 != 0;
        break;
      case 1:
        facts_.armed = random_.Next() % 2 == 0;
        break;
      case 2:
        facts_.mode = random_.Next() % 2   ? kOffboardMode
                      : random_.Next() % 2 ? kLandMode
                                           : kPosition;
        break;
      case 3:
        facts_.failsafe = random_.Next() % 4 == 0;
        break;
      case 4:
        facts_.on_ground = random_.Next() % 2 == 0;
        break;
      case 5:
      case 6:
        facts_.wish = random_.Next() % 4 != 0;
        facts_.motors_off = !facts_.wish && random_.Next() % 2 == 0;
        break;
      case 7:
        facts_.blind = random_.Next() % 4 == 0;
        facts_.borne = random_.Next() % 4 != 0;
        facts_.terminated = random_.Next() % 8 == 0;
        break;
      case 8:
        facts_.gap = random_.Next() % 2 == 0 ? 0.0 : random_.Uniform();
        break;
      default:
        facts_.missing = random_.Next() % 4 == 0 ? "something" : "";
    }
    return facts_;
  }
  /// An answer to anything, asked for or not.
  void Answer(Handshake* handshake) {
    if (random_.Next() % 40 != 0) return;
    const uint16_t commands[] = {176, 400, 511, 22};
    handshake->OnAck(commands[random_.Next() % 4], static_cast<uint8_t>(random_.Next() % 12),
                     facts_.utime);
  }
  world::Random& random() { return random_; }

 private:
  world::Random random_;
  Facts facts_;
};

TEST(FcuHandshake, KeepsItsPromisesInAnyOrderOfInputs) {
  std::set<State> reached;
  int armings = 0;
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    Chaos chaos(seed);
    const bool engages = seed % 3 != 0;
    Handshake handshake(engages, kGiveUp);
    int64_t stream_since = 0, wished = 0;
    State last = handshake.state();
    for (int i = 0; i < 6000; ++i) {
      const Facts& facts = chaos.Next();
      chaos.Answer(&handshake);
      if (facts.wish) wished = facts.utime;
      handshake.Update(facts);
      if (chaos.random().Next() % 2000 == 0) handshake.Kill();
      const State state = handshake.state();
      reached.insert(state);
      stream_since = !handshake.streams() ? 0 : stream_since == 0 ? facts.utime : stream_since;
      // A latched state is left only disarmed and after two seconds without setpoints, or to
      // disarm what we armed too late; where the pilot engages he may give it back.
      if (Latched(last) && state != last) {
        const bool released = !facts.armed && facts.utime - wished >= 2'000'000;
        const bool killed = last == State::kFailsafe && state == State::kKilling;
        const bool given_back = last == State::kPilot && !engages && !facts.failsafe;
        EXPECT_TRUE(released || given_back || killed || state == State::kDisarming) << seed;
      }
      EXPECT_FALSE((Latched(state) || state == State::kLanding || state == State::kKilling) &&
                   handshake.streams());
      if (const auto command = handshake.NextCommand(facts.utime)) {
        EXPECT_TRUE(engages || command->param1 == 0.0f)
            << "only lands and disarms where the pilot engages";
        EXPECT_EQ(command->param2 == 21196.0f, state == State::kKilling)
            << "by force: a kill alone";
        if (IsArm(*command) || IsOffboard(*command)) {
          EXPECT_TRUE(facts.wish && facts.missing.empty() && !facts.armed) << seed;
          EXPECT_TRUE(stream_since != 0 && facts.utime - stream_since >= 1'000'000) << seed;
        }
        if (IsArm(*command)) {
          ++armings;
          EXPECT_TRUE(facts.mode == kOffboardMode) << seed;
        }
      }
      last = state;
    }
  }
  EXPECT_EQ(reached.size(), 14u) << "states that were visited";
  EXPECT_GT(armings, 50);
}

TEST(FcuHandshake, FliesInAFriendlyWorldFromAnywhere) {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    Chaos chaos(seed);
    Handshake handshake(true, kGiveUp);
    Facts facts;
    for (int i = 0; i < 1000 + static_cast<int>(seed) * 13 % 3000; ++i) {
      facts = chaos.Next();
      chaos.Answer(&handshake);
      handshake.Update(facts);
      handshake.NextCommand(facts.utime);
    }
    // Setpoints cease, it stands disarmed; then another flight is asked for.
    facts = Heard(kPosition);
    facts.utime += 100'000'000;
    facts.on_ground = true;
    for (int i = 0; i < 300; ++i, facts.utime += kTick) handshake.Update(facts);
    EXPECT_EQ(handshake.state(), State::kStandby) << seed << Handshake::Name(handshake.state());
    facts.wish = true;
    for (int i = 0; i < 500 && handshake.state() != State::kFlying; ++i, facts.utime += kTick) {
      handshake.Update(facts);
      if (const auto command = handshake.NextCommand(facts.utime)) {
        if (IsOffboard(*command)) facts.mode = kOffboardMode;
        if (IsArm(*command)) facts.armed = true;
      }
    }
    EXPECT_EQ(handshake.state(), State::kFlying) << seed;
  }
}

TEST(FcuHandshake, EveryAskEnds) {
  for (const bool answers : {false, true}) {
    for (const Mode mode : {kPosition, kOffboardMode}) {
      Handshake handshake(true, kGiveUp);
      Facts facts = Heard(mode);
      facts.wish = facts.on_ground = true;
      for (int i = 0; i < 1400; ++i, facts.utime += kTick) {
        handshake.Update(facts);
        if (const auto command = handshake.NextCommand(facts.utime); command && answers)
          handshake.OnAck(command->command, 1, facts.utime);  // not now, for ever
      }
      EXPECT_EQ(handshake.state(), State::kRefused) << Handshake::Name(handshake.state());
      EXPECT_FALSE(handshake.streams());
    }
  }
}

TEST(FcuHandshake, UnansweredCommandsAreSentAgainAndCounted) {
  Command command;
  command.Begin(Ask::kArm, kStart);
  int sent = 0;
  for (int64_t t = kStart; t < kStart + 3'000'000; t += kTick)
    if (const auto m = command.Tick(t)) {
      EXPECT_EQ(m->confirmation, sent++);
    }
  EXPECT_EQ(sent, 6);
  command.OnAck(176, 2, kStart);
  EXPECT_EQ(command.answer(), Command::Answer::kWaiting) << "another command's";
  command.OnAck(400, 2, kStart);
  EXPECT_EQ(command.answer(), Command::Answer::kRefused);
  EXPECT_EQ(command.words(), "denied");
  EXPECT_FALSE(command.Tick(kStart + 60'000'000));
}

TEST(FcuHandshake, WhatIsRefusedIsSaidUntilItIsAccepted) {
  for (const auto& [what, words] :
       {std::pair{State::kLanding, "landing"}, std::pair{State::kDisarming, "disarming"},
        std::pair{State::kKilling, "disarming by force"}}) {
    Engaged flight(true);
    if (what == State::kKilling) flight.handshake.Kill();
    flight.facts.wish = false;
    flight.facts.motors_off = flight.facts.on_ground = what == State::kDisarming;
    flight.Run(0.7);
    ASSERT_EQ(flight.handshake.state(), what);
    for (const auto& [result, answer] :
         {std::pair{1, " was refused (not now)"}, std::pair{2, " was refused (denied)"}}) {
      const auto command = flight.handshake.NextCommand(flight.facts.utime);
      ASSERT_TRUE(command) << words;
      flight.handshake.OnAck(command->command, static_cast<uint8_t>(result), flight.facts.utime);
      flight.facts.said = "not landed";
      flight.Run(3.0);
      EXPECT_NE(flight.handshake.reason().find(std::string("; ") + words + answer + ": not landed"),
                std::string::npos)
          << flight.handshake.reason();
    }
    const auto command = flight.handshake.NextCommand(flight.facts.utime);
    ASSERT_TRUE(command) << words;
    flight.handshake.OnAck(command->command, 0, flight.facts.utime);
    EXPECT_EQ(flight.handshake.reason().find("refused"), std::string::npos);
  }
}

// OFFBOARD was asked for several times; answers are slow.
TEST(FcuHandshake, ALateAnswerToOffboardIsNoneToLanding) {
  for (const uint8_t late : {uint8_t{0}, uint8_t{2}}) {
    Command command;
    command.Begin(Ask::kOffboard, kStart);
    const auto offboard = command.Tick(kStart);
    ASSERT_TRUE(offboard);
    command.Begin(Ask::kLand, kStart);
    ASSERT_TRUE(command.Tick(kStart));
    command.OnAck(offboard->command, late, kStart);
    EXPECT_EQ(command.answer(), Command::Answer::kWaiting);
    EXPECT_TRUE(command.Tick(kStart + 500'000)) << "as if nothing had been answered";
  }
}

}  // namespace
}  // namespace chase::fcu::testing
