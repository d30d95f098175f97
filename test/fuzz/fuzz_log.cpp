// An LCM log, whole, cut off or damaged.
#include <sys/mman.h>
#include <unistd.h>

#include "common/logs/log_reader.h"
#include "logs/src/info.h"
#include "test/fuzz/target.h"

namespace {

using namespace chase;  // NOLINT(google-build-using-namespace)

/// A file in memory alone.
class MemoryFile {
 public:
  MemoryFile(const uint8_t* data, size_t size) : fd_(memfd_create("fuzz", MFD_CLOEXEC)) {
    fuzz::Require(write(fd_, data, size) == static_cast<ssize_t>(size), "memory takes a file");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(fd_); }
  std::string name() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

void ReadAll(const std::string& file) {
  logs::LogReader log(file);
  logs::LogEvent event;
  int64_t at = -1;
  while (log.Next(&event)) {
    fuzz::Require(log.position() > at, "a log is read forwards");
    fuzz::Require(event.utime / 2 < INT64_MAX / 4 && event.utime / 2 > INT64_MIN / 4 - 1,
                  "any two stamps can be subtracted");
    at = log.position();
  }
  fuzz::Require(log.AtEnd(), "a log is read to its end");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const MemoryFile file(data, size);
  try {
    ReadAll(file.name());
    logs::Format(logs::Describe(file.name()));
  } catch (const std::runtime_error& error) {
    fuzz::Require(std::string(error.what()).rfind(file.name(), 0) == 0,
                  "a refusal begins with the log's name");
  }
  return 0;
}
