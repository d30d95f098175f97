// Preloaded into processes, or linked into a test, it lets their host's wall clock step: what they
// ask for, and the kernel's stamps of what they receive, as if somebody had set it.

#include "test/flight/wall_clock.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

template <class Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

void Shift(timespec* time) {
  const int64_t us = int64_t{time->tv_sec} * 1'000'000 + time->tv_nsec / 1000;
  int64_t by = 0;
  for (const ChaseClockStep* step = ChaseClockSteps(); step->from != 0; ++step)
    if (us >= step->from) by += step->by;
  const int64_t to = us + by;
  *time = {to / 1'000'000, (to % 1'000'000) * 1000 + time->tv_nsec % 1000};
}

void Shift(timeval* time) {
  timespec t{time->tv_sec, time->tv_usec * 1000};
  Shift(&t);
  *time = {t.tv_sec, t.tv_nsec / 1000};
}

}  // namespace

extern "C" {

ChaseClockStep* ChaseClockSteps() {
  static ChaseClockStep own[kChaseMostSteps];
  static ChaseClockStep* const steps = [] {
    const char* file = std::getenv("CHASE_TEST_CLOCK");
    const int fd = file ? open(file, O_RDONLY | O_CLOEXEC) : -1;
    void* at = fd < 0 ? MAP_FAILED : mmap(nullptr, sizeof own, PROT_READ, MAP_SHARED, fd, 0);
    return at == MAP_FAILED ? own : static_cast<ChaseClockStep*>(at);
  }();
  return steps;
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* const next = Next<int(clockid_t, timespec*)>("clock_gettime");
  const int answer = next(clock, time);
  if (answer == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) Shift(time);
  return answer;
}

int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* time) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (time) *time = now.tv_sec;
  return now.tv_sec;
}

ssize_t recvmsg(int fd, msghdr* message, int flags) {
  static auto* const next = Next<ssize_t(int, msghdr*, int)>("recvmsg");
  const ssize_t size = next(fd, message, flags);
  for (cmsghdr* c = size < 0 ? nullptr : CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMP) Shift(reinterpret_cast<timeval*>(CMSG_DATA(c)));
    if (c->cmsg_type == SCM_TIMESTAMPNS) Shift(reinterpret_cast<timespec*>(CMSG_DATA(c)));
  }
  return size;
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  static auto* const next = Next<int(int, unsigned long, ...)>("ioctl");
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  const int answer = next(fd, request, argument);
  if (answer == 0 && request == SIOCGSTAMPNS) Shift(static_cast<timespec*>(argument));
  return answer;
}
}
