#pragma once

#include <cstdint>

constexpr int kChaseMostSteps = 64;

/// One of the wall clock, us: from which true time since 1970 on it counts, and by what.
struct ChaseClockStep {
  int64_t from, by;
};

/// Room for so many; they end where `from` is 0. Where CHASE_TEST_CLOCK names a file, it holds them
/// for all processes.
extern "C" ChaseClockStep* ChaseClockSteps();
