#include "common/bus/host_clock.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>

namespace chase::bus {
namespace {

template <class Clock>
int64_t Microseconds() {
  using std::chrono::microseconds;
  return std::chrono::duration_cast<microseconds>(Clock::now().time_since_epoch()).count();
}

constexpr int64_t kSet = 1000;  // us: by more than what NTP slews it within a second

/// Whoever is interrupted between the two clocks asks again.
int64_t WallAhead() {
  int64_t ahead = 0, least = INT64_MAX;
  for (int attempt = 0; attempt < 5 && least > kSet / 2; ++attempt) {
    const int64_t before = SteadyMicroseconds(), wall = WallMicroseconds();
    const int64_t took = SteadyMicroseconds() - before;
    if (took < least) ahead = wall - before;
    least = std::min(least, took);
  }
  return ahead;
}

std::optional<int64_t> Read(const std::string& file) {
  std::ifstream in(file);
  int64_t offset = 0;
  if (in >> offset) return offset;
  return std::nullopt;
}

}  // namespace

int64_t SteadyMicroseconds() { return Microseconds<std::chrono::steady_clock>(); }
int64_t WallMicroseconds() { return Microseconds<std::chrono::system_clock>(); }

WallClockWatch::WallClockWatch() : ahead_(WallAhead()) {}

bool WallClockWatch::WasSet(int64_t us) {
  const int64_t ahead = WallAhead();
  if (std::abs(ahead - ahead_) > kSet) set_at_ = SteadyMicroseconds();
  ahead_ = ahead;
  return set_at_ && SteadyMicroseconds() - *set_at_ <= us;
}

int64_t HostClockOffset(const std::string& file) {
  if (const auto agreed = Read(file)) return *agreed;
  const int64_t own = WallMicroseconds() - SteadyMicroseconds();
  // Whole from the first moment on, and never over another's: written aside, then linked.
  const std::string aside = fmt::format("{}.{}", file, getpid());
  std::ofstream(aside) << own << '\n';
  (void)!link(aside.c_str(), file.c_str());
  std::remove(aside.c_str());
  return Read(file).value_or(own);
}

}  // namespace chase::bus
