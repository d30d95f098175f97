#include "common/bus/host_clock.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <optional>

namespace chase::bus {
namespace {

template <class Clock>
int64_t Microseconds() {
  using std::chrono::microseconds;
  return std::chrono::duration_cast<microseconds>(Clock::now().time_since_epoch()).count();
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
