#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "services/mission/states.h"

namespace chase::mission {
namespace {

bool IsCommand(Event e) { return e <= Event::kKill; }

/// The flight in rules rather than rows: what is known of the vehicle, and what it is to do.
class Model {
 public:
  State state() const {
    if (off_) return State::kDone;
    if (!aloft_) return complete_ ? State::kReady : State::kIdle;
    if (blind_) return State::kEmergency;
    return task_;
  }

  /// Is the command obeyed? What is observed always counts.
  bool Take(Event e) {
    if (IsCommand(e)) return Obey(e);
    Observe(e);
    return true;
  }

 private:
  bool Obey(Event e) {
    if (e == Event::kKill) {
      const bool was_off = off_;
      off_ = true;
      return !was_off;
    }
    if (off_ || (aloft_ && blind_)) return false;
    if (!aloft_) {
      if (e != Event::kTakeoff || !complete_) return false;
      aloft_ = true;
      task_ = State::kTakeoff;
      return true;
    }
    if (e == Event::kTakeoff) return false;
    const bool brakes = e == Event::kHold || e == Event::kStop;
    if (task_ == State::kLand && !brakes && e != Event::kLand) return false;
    if (task_ == State::kTakeoff && e == Event::kSearch) return false;
    // Whoever looks for the target chases it as soon as it is there.
    if (task_ == State::kSearch && e == Event::kChase) return true;
    task_ = brakes                ? State::kHold
            : e == Event::kChase  ? State::kChase
            : e == Event::kSearch ? State::kSearch
            : e == Event::kReturn ? State::kReturn
                                  : State::kLand;
    return true;
  }

  void Observe(Event e) {
    if (off_) return;
    if (e == Event::kMotorsOff) off_ = true;
    if (!aloft_) {
      if (e == Event::kComplete || e == Event::kMissing) complete_ = e == Event::kComplete;
      if (e != Event::kFlying && e != Event::kLanding) return;
      aloft_ = true;
      task_ = e == Event::kFlying ? State::kHold : State::kLand;
      return;
    }
    if (e == Event::kDisarmed) off_ = true;
    if (e == Event::kPoseLost) blind_ = true;
    if (blind_) {
      if (e == Event::kNotFlown) {
        aloft_ = blind_ = false;
        complete_ = true;
      }
      if (e != Event::kPoseBack) return;
      blind_ = false;
      task_ = State::kHold;
      return;
    }
    Advance(e);
  }

  void Advance(Event e) {
    const std::pair<State, Event> now{task_, e};
    if (now == std::pair(State::kTakeoff, Event::kUp)) task_ = State::kHold;
    if (e == Event::kNotFlown && task_ != State::kReturn && task_ != State::kLand) {
      aloft_ = false;
      complete_ = true;
    }
    if (now == std::pair(State::kChase, Event::kLost)) task_ = State::kSearch;
    if (now == std::pair(State::kSearch, Event::kSeen)) task_ = State::kChase;
    if (now == std::pair(State::kSearch, Event::kGaveUp)) task_ = State::kReturn;
    if (now == std::pair(State::kReturn, Event::kHome)) task_ = State::kLand;
    if (now == std::pair(State::kReturn, Event::kHomeLost)) task_ = State::kLand;
    if (now == std::pair(State::kReturn, Event::kStuck)) task_ = State::kLand;
    const bool leads =
        task_ == State::kTakeoff || task_ == State::kChase || task_ == State::kSearch;
    const bool stays_up = leads || task_ == State::kHold;
    if (e == Event::kLeaving && leads) task_ = State::kHold;
    if ((e == Event::kOutside || e == Event::kBatteryLow) && stays_up) task_ = State::kReturn;
    if (e == Event::kBatteryCritical || e == Event::kUnplanned || e == Event::kUnmapped)
      task_ = State::kLand;
  }

  bool off_ = false, aloft_ = false, complete_ = false, blind_ = false;
  State task_ = State::kHold;
};

TEST(States, TheTableWalksAsTheRulesDo) {
  std::set<std::pair<State, Event>> visited;
  for (unsigned seed = 1; seed <= 4000; ++seed) {
    std::mt19937 random(seed);
    State state = State::kIdle;
    Model model;
    for (int i = 0; i < 80; ++i) {
      const auto event = static_cast<Event>(random() % kEvents);
      // Motors that are off end the walk: later steps see more of the table.
      const bool ends =
          event == Event::kMotorsOff || event == Event::kDisarmed || event == Event::kKill;
      if (ends && i < 10) continue;
      visited.emplace(state, event);
      const Transition* row = Find(state, event);
      const bool obeyed = model.Take(event);
      if (row != nullptr) state = row->to;
      ASSERT_EQ(state, model.state())
          << "seed " << seed << ", step " << i << ", event " << static_cast<int>(event);
      ASSERT_TRUE(!IsCommand(event) || obeyed == (row != nullptr))
          << "seed " << seed << ", step " << i;
    }
  }
  EXPECT_EQ(visited.size(), static_cast<size_t>(kStates * kEvents))
      << "every state met every event";
}

TEST(States, ARowIsFoundOnceAndHasAReason) {
  std::set<std::pair<State, Event>> seen;
  for (const Transition& row : Transitions()) {
    EXPECT_TRUE(seen.emplace(row.from, row.on).second)
        << Name(row.from) << ", event " << static_cast<int>(row.on);
    EXPECT_NE(std::string(row.reason), "");
  }
}

TEST(States, EveryStateHasAWayToDoneAndNothingLeavesDone) {
  std::set<State> ends = {State::kDone};
  for (int i = 0; i < kStates; ++i)
    for (const Transition& row : Transitions())
      if (ends.count(row.to) > 0) ends.insert(row.from);
  EXPECT_EQ(ends.size(), static_cast<size_t>(kStates));
  for (const Transition& row : Transitions()) EXPECT_NE(row.from, State::kDone);
}

TEST(States, TheGroundIsLeftByTakeOffAloneUnlessItFliesAlready) {
  for (const Transition& row : Transitions()) {
    const bool leaves = !IsAirborne(row.from) && IsAirborne(row.to);
    EXPECT_TRUE(!leaves || row.on == Event::kTakeoff || row.on == Event::kFlying ||
                row.on == Event::kLanding);
  }
}

}  // namespace
}  // namespace chase::mission
