#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

/// Part of every program (ChaseTargets.cmake): what standard output did not take, as on a full
/// disk, is said at the end, and the exit code is not 0.
namespace {

void CheckOutput(int code, void*) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  std::fprintf(stderr, "%s: standard output could not be written; is the disk full?\n",
               program_invocation_short_name);
  _exit(code != 0 ? code : 1);
}

[[maybe_unused]] const int registered = on_exit(CheckOutput, nullptr);

}  // namespace
