#include <gtest/gtest.h>

#include <iterator>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "common/world/commands.h"
#include "services/mission/progress.h"
#include "test/unit/bad_line.h"
#include "test/unit/mission_bench.h"

namespace chase::mission {
namespace {

TEST(Commands, OfAnotherTimeAreRefused) {
  Bench bench({}, 9.0);
  bench.Fly();
  const auto given = [&](double t, int64_t id) {
    return bench.mission.Obey(bench.t, {{"command", 1, id, t}, Event::kChase});
  };
  EXPECT_TRUE(given(8.9, 100).unknown) << "a process before this one may have obeyed it";
  EXPECT_FALSE(given(8.9, 100).accepted);
  EXPECT_FALSE(given(bench.t + 11.0, 102).unknown);
  EXPECT_FALSE(given(bench.t + 11.0, 102).accepted) << "from the future";
  bench.Run(20.0);
  EXPECT_FALSE(given(bench.t - 11.0, 101).accepted) << "old";
  EXPECT_EQ(bench.mission.state(), State::kHold);
  EXPECT_TRUE(given(bench.t - 1.0, 103).accepted);
}

TEST(Commands, AreToldApartBySenderStartAndId) {
  Bench bench;
  bench.Fly();
  const auto obey = [&](const char* sender, int64_t start, int64_t id, Event kind) {
    return bench.mission.Obey(bench.t, {{sender, start, id, bench.t}, kind}).accepted;
  };
  EXPECT_TRUE(obey("command", 1, 500, Event::kChase));
  for (const auto& [sender, start, id] :
       {std::tuple("command", 2, 500), std::tuple("viewer", 1, 500),
        std::tuple("command", 1, 501)}) {
    EXPECT_TRUE(obey(sender, start, id, Event::kHold));
    EXPECT_EQ(bench.mission.state(), State::kHold);
    EXPECT_TRUE(obey("command", 1, 500, Event::kChase)) << "answered as before";
    EXPECT_EQ(bench.mission.state(), State::kHold) << "and not obeyed again";
    EXPECT_TRUE(obey(sender, start, id + 1000, Event::kChase));
  }
}

TEST(Commands, ARefusedOneStaysRefused) {
  Bench bench;
  bench.hears_target = false;
  bench.Run(1.0);
  const Command command{{"command", 1, 7, bench.t}, Event::kTakeoff};
  const world::CommandAnswer first = bench.mission.Obey(bench.t, command);
  EXPECT_FALSE(first.accepted);
  bench.hears_target = true;
  bench.Run(0.5);
  ASSERT_EQ(bench.mission.state(), State::kReady);
  const world::CommandAnswer again = bench.mission.Obey(bench.t, command);
  EXPECT_FALSE(again.accepted);
  EXPECT_EQ(again.reason, first.reason);
  EXPECT_EQ(bench.mission.state(), State::kReady);
  EXPECT_TRUE(bench.Command(Event::kTakeoff).accepted);
}

TEST(Commands, MoreThanCanBeRememberedAreRefusedAndNoneIsObeyedTwice) {
  Bench bench;
  bench.Fly();
  std::vector<Command> obeyed;
  int refused = 0;
  for (int64_t id = 1000; id < 1400; ++id) {
    const Command command{{"command", 1, id, bench.t}, id % 2 == 0 ? Event::kChase : Event::kHold};
    const bool accepted = bench.mission.Obey(bench.t, command).accepted;
    if (accepted) obeyed.push_back(command);
    refused += !accepted;
  }
  EXPECT_GT(refused, 100);
  const State state = bench.mission.state();
  for (const Command& command : obeyed) {
    bench.mission.Obey(bench.t, command);
    ASSERT_EQ(bench.mission.state(), state) << command.id;
  }
  bench.Run(15.0);
  EXPECT_TRUE(bench.Command(Event::kHold, 2000).accepted) << "after a while there is room";
}

TEST(Commands, StopAndKillAreTakenHoweverManyCame) {
  for (const Event urgent : {Event::kStop, Event::kKill}) {
    Bench bench;
    bench.Fly();
    int64_t id = 1000;
    while (id < 1600) bench.Command(id % 2 == 0 ? Event::kHold : Event::kChase, id), ++id;
    ASSERT_TRUE(bench.Command(Event::kChase, 1000).accepted) << "known still: the same answer";
    ASSERT_FALSE(bench.Command(Event::kChase, id++).accepted) << "no room";
    for (int i = 0; i < 600; ++i)  // not even by a flood of themselves
      ASSERT_TRUE(bench.Command(Event::kStop, id++).accepted) << i;
    const Command command{{"command", 1, ++id, bench.t}, urgent, true};
    const world::CommandAnswer answer = bench.mission.Obey(bench.t, command);
    EXPECT_TRUE(answer.accepted) << answer.reason;
    EXPECT_EQ(bench.mission.state(), urgent == Event::kStop ? State::kHold : State::kDone);
    EXPECT_TRUE(bench.mission.Obey(bench.t, command).accepted) << "the same answer again";
    EXPECT_FALSE(bench.mission.Obey(bench.t, {{"command", 1, ++id, 0.0}, urgent, true}).accepted)
        << "an old one is refused all the same";
  }
}

// Its operator stopped it while nobody listened, and `chase-command` says so again and again.
TEST(Commands, StopAndKillThatWereGivenBeforeTheProcessStartedAreObeyed) {
  for (const Event urgent : {Event::kStop, Event::kKill, Event::kLand}) {
    Bench bench;
    bench.Fly();
    Mission anew(MissionConfig(), bench.t);
    anew.inputs() = bench.mission.inputs();
    anew.inputs().flying = true;
    anew.Update(bench.t);
    const Command command{{"command", 1, 77, bench.t - 3.0}, urgent, true};
    EXPECT_EQ(anew.Obey(bench.t, command).accepted, urgent != Event::kLand);
    EXPECT_EQ(anew.state(), urgent == Event::kKill ? State::kDone : State::kHold);
  }
}

// Late copies of earlier commands keep coming while the next ones are given. Every third is one
// that its state refuses.
TEST(Commands, TakeEffectOnceOrAreRefusedOnABadLine) {
  constexpr std::pair<Event, State> kCycle[] = {
      {Event::kChase, State::kChase},   {Event::kHold, State::kHold},
      {Event::kSearch, State::kSearch}, {Event::kReturn, State::kReturn},
      {Event::kLand, State::kLand},     {Event::kHold, State::kHold}};
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    Bench bench;
    bench.Fly({5.0, 0.0, 1.0});
    test::BadLine<Command> there(&random);
    test::BadLine<std::pair<int64_t, world::CommandAnswer>> back(&random);
    int given = 0, changes = 0;
    State expected = State::kHold;
    for (int64_t id = 1; id <= 100; ++id) {
      const bool fits = id % 3 != 0;
      const auto& [kind, reached] = kCycle[given % std::size(kCycle)];
      const Command command{{"command", 5, 10'000 + id, bench.t}, fits ? kind : Event::kTakeoff};
      world::CommandClient client(static_cast<int>(command.kind), bench.t);
      while (!client.answered()) {
        ASSERT_FALSE(client.GaveUp(bench.t)) << "seed " << seed << ", command " << id;
        if (client.Due(bench.t)) there.Send(bench.t, command);
        bench.tracked = bench.mission.state() == State::kChase;  // a search finds nothing
        bench.Run(kTick);
        for (const Command& c : there.Arrived(bench.t)) {
          const State before = bench.mission.state();
          back.Send(bench.t, {c.id, bench.mission.Obey(bench.t, c)});
          changes += bench.mission.state() != before;
        }
        for (const auto& [of, answer] : back.Arrived(bench.t))
          if (of == command.id) client.OnAnswer(answer.accepted, answer.reason);
      }
      ASSERT_EQ(client.accepted(), fits) << client.reason();
      if (fits) expected = reached;
      if (!fits) {
        ASSERT_EQ(client.reason(),
                  std::string("takeoff in ") + Name(expected) + ": " + Refusal(expected));
      }
      given += fits;
      ASSERT_EQ(changes, given) << "seed " << seed << ": each once, none again";
      ASSERT_EQ(bench.mission.state(), expected);
    }
  }
}

TEST(Commands, KillNeedsForceInEveryState) {
  for (const bool flies : {false, true}) {
    Bench bench;
    bench.Run(0.5);
    if (flies) bench.Fly();
    const State before = bench.mission.state();
    const auto kill = [&](bool force, int64_t id) {
      return bench.mission.Obey(bench.t, {{"command", 1, id, bench.t}, Event::kKill, force});
    };
    const world::CommandAnswer refused = kill(false, 900);
    EXPECT_FALSE(refused.accepted);
    EXPECT_NE(refused.reason.find("--force"), std::string::npos);
    EXPECT_EQ(bench.mission.state(), before);
    // A command that is meant to be something else cannot be forced into a kill.
    EXPECT_FALSE(kill(true, 900).accepted) << "the same command again";
    EXPECT_TRUE(kill(true, 901).accepted);
    EXPECT_EQ(bench.mission.state(), State::kDone);
    EXPECT_EQ(bench.mission.reason(), "killed: motors cut by command");
    EXPECT_FALSE(kill(true, 902).accepted) << "they are off";
  }
}

TEST(CommandClient, RepeatsUntilAnsweredAndGivesUp) {
  world::CommandClient client(2, 1.0);
  EXPECT_TRUE(client.Due(1.0));
  EXPECT_FALSE(client.Due(1.05));
  EXPECT_TRUE(client.Due(1.11));
  EXPECT_FALSE(client.GaveUp(5.9));
  EXPECT_TRUE(client.GaveUp(6.1));
  client.OnAnswer(true, "HOLD");
  client.OnAnswer(false, "late");
  EXPECT_TRUE(client.accepted());
  EXPECT_FALSE(client.Due(7.0));
  EXPECT_FALSE(client.GaveUp(9.0));
}

// One of two who hear it has answered: the other may not have heard it yet.
TEST(CommandClient, AKillIsSentForAWhileAfterItsAnswer) {
  world::CommandClient kill(world::kKillCommand, 1.0), refused(world::kKillCommand, 1.0);
  for (world::CommandClient* client : {&kill, &refused}) EXPECT_TRUE(client->Due(1.0));
  kill.OnAnswer(true, "killed");
  refused.OnAnswer(false, "say so with --force");
  int sent = 0, sent_refused = 0;
  for (double t = 1.0; t < 6.0; t += 0.02) {
    sent += kill.Due(t);
    sent_refused += refused.Due(t);
  }
  EXPECT_NEAR(sent, 18, 2);
  EXPECT_EQ(sent_refused, sent) << "mission may have had one before";
  EXPECT_FALSE(kill.IsDone(2.9));
  EXPECT_TRUE(kill.IsDone(3.1));
  EXPECT_FALSE(kill.GaveUp(9.0));
}

TEST(CommandClient, KnowsWhenTheFlightIsThere) {
  EXPECT_EQ(ProgressOf(Event::kTakeoff, State::kTakeoff), Progress::kUnderWay);
  EXPECT_EQ(ProgressOf(Event::kTakeoff, State::kHold), Progress::kReached);
  EXPECT_EQ(ProgressOf(Event::kReturn, State::kLand), Progress::kUnderWay);
  EXPECT_EQ(ProgressOf(Event::kReturn, State::kDone), Progress::kReached);
  EXPECT_EQ(ProgressOf(Event::kReturn, State::kHold), Progress::kMissed);
  EXPECT_EQ(ProgressOf(Event::kChase, State::kSearch), Progress::kUnderWay);
  EXPECT_EQ(ProgressOf(Event::kChase, State::kEmergency), Progress::kMissed);
  EXPECT_EQ(ProgressOf(Event::kStop, State::kHold), Progress::kReached);
  for (int i = 0; i <= static_cast<int>(Event::kKill); ++i)
    EXPECT_EQ(world::CommandNamed(Name(static_cast<Event>(i))), i);
  EXPECT_FALSE(world::CommandNamed("fly").has_value());
}

}  // namespace
}  // namespace chase::mission
