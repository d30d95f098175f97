#pragma once

#include <cstdint>
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

}  // namespace chase::bus
