#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace chase::bus {

/// Where the processes of a host keep their common offset; gone with the next boot.
inline constexpr char kClockFile[] = "/dev/shm/chase-clock";

/// Microseconds from the steady clock to the wall clock as it was when the first process on this
/// host asked: the same for all that start later, whatever became of the wall clock since. Where
/// `file` can be neither written nor read, as it is now.
int64_t HostClockOffset(const std::string& file = kClockFile);

/// The steady clock, and the time since 1970, us.
int64_t SteadyMicroseconds();
int64_t WallMicroseconds();

/// Notices that somebody sets the wall clock, by its difference from the steady clock. Stamps of
/// before then tell no age.
class WallClockWatch {
 public:
  WallClockWatch();
  /// Was it set within the last `us`? A set that nobody asked after counts from now on.
  bool WasSet(int64_t us);

 private:
  int64_t ahead_;                  // of the steady clock when last asked, us
  std::optional<int64_t> set_at_;  // the steady clock, us
};

}  // namespace chase::bus
