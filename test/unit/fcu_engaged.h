#pragma once

#include <gtest/gtest.h>

#include "services/fcu/handshake.h"

/// The hand-shake by itself, fed with facts: what its tests begin with.
namespace chase::fcu::testing {

inline constexpr int64_t kStart = 1'700'000'000'000'000;  // us
inline constexpr int64_t kTick = 10'000;                  // us
inline constexpr double kGiveUp = 10.0;                   // s
inline constexpr Mode kPosition{3, 0};

inline Facts Heard(Mode mode) {
  Facts facts;
  facts.utime = kStart;
  facts.heard = true;
  facts.mode = mode;
  return facts;
}

/// In OFFBOARD: armed and in flight, or on the ground and asking to arm.
struct Engaged {
  Handshake handshake{true, kGiveUp};
  Facts facts = Heard(kOffboardMode);
  explicit Engaged(bool flies) {
    facts.wish = true;
    facts.armed = flies;
    facts.on_ground = !flies;
    Run(1.5);
    EXPECT_EQ(handshake.state(), flies ? Handshake::State::kFlying : Handshake::State::kArming);
  }
  void Run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 1e6) / kTick; ++i, facts.utime += kTick) {
      facts.told = facts.utime;
      handshake.Update(facts);
    }
  }
  /// Control hangs in flight; LAND is not heard of yet.
  void LosesControl() {
    facts.wish = false;
    Run(0.7);
    EXPECT_EQ(handshake.state(), Handshake::State::kLanding);
  }
};

}  // namespace chase::fcu::testing
