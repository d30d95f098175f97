#include "common/bus/log_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "common/bus/loopback.h"

namespace chase::bus {
namespace {

constexpr uint8_t kSync[4] = {0xED, 0xA1, 0xDA, 0x01};
constexpr int64_t kHeaderBytes = 28;           // sync word, number, stamp, two lengths
constexpr int64_t kLongestChannel = 63;        // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr int64_t kLatest = int64_t{1} << 61;  // us, 73,000 years: any two stamps can be subtracted

template <class T>
T BigEndianAt(const uint8_t* from) {
  uint64_t bits = 0;
  for (size_t i = 0; i < sizeof(T); ++i) bits = bits << 8 | from[i];
  return static_cast<T>(bits);
}

}  // namespace

/// What stands before an event's channel and data; `size` 0: there is no event of possible lengths
/// and a possible stamp.
struct LogReader::Header {
  int64_t utime = 0, channel_bytes = 0, data_bytes = 0, size = 0;
};

std::string LogOf(const std::string& flight) {
  namespace fs = std::filesystem;
  return fs::is_directory(flight) ? (fs::path(flight) / "flight.lcm").string() : flight;
}

std::string Format(const Damage& d) {
  if (d.at_end)
    return fmt::format("the last {} bytes are no whole event: the log was cut off", d.bytes);
  return fmt::format(
      "{} bytes at {} are no whole event: the log is damaged, maybe the message before them, too",
      d.bytes, d.at);
}

LogReader::LogReader(const std::string& file, Watch watch) : file_(file), watch_(std::move(watch)) {
  if (!std::filesystem::is_regular_file(file))
    throw std::runtime_error(file + (std::filesystem::exists(file)
                                         ? ": is no regular file; name a log"
                                         : ": no such file; check the path"));
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw std::runtime_error(file + ": cannot be opened; check its permissions");
  size_ = static_cast<int64_t>(std::filesystem::file_size(file));
  void* map = size_ > 0 ? mmap(nullptr, static_cast<size_t>(size_), PROT_READ, MAP_PRIVATE, fd, 0)
                        : MAP_FAILED;
  close(fd);
  if (size_ == 0) throw std::runtime_error(file + ": is empty; record the log again");
  if (map == MAP_FAILED) throw std::runtime_error(file + ": cannot be read as a whole");
  data_ = static_cast<const uint8_t*>(map);
  if (!BeginsAt(0) && FindEvent(0, size_) == size_) {
    munmap(map, static_cast<size_t>(size_));
    throw std::runtime_error(file + ": is no LCM log (it does not begin with ED A1 DA 01)");
  }
}

LogReader::~LogReader() { munmap(const_cast<uint8_t*>(data_), static_cast<size_t>(size_)); }

/// A sync word, or as much of one as the file still holds; the end of the file is a beginning, too.
bool LogReader::BeginsAt(int64_t at) const {
  return std::memcmp(data_ + at, kSync, static_cast<size_t>(std::min<int64_t>(4, size_ - at))) == 0;
}

LogReader::Header LogReader::HeaderAt(int64_t at) const {
  Header h;
  if (size_ - at < kHeaderBytes || !BeginsAt(at)) return h;
  h.utime = BigEndianAt<int64_t>(data_ + at + 12);
  h.channel_bytes = BigEndianAt<int32_t>(data_ + at + 20);
  h.data_bytes = BigEndianAt<int32_t>(data_ + at + 24);
  const int64_t end = at + kHeaderBytes + h.channel_bytes + h.data_bytes;
  if (h.channel_bytes < 1 || h.channel_bytes > kLongestChannel || h.data_bytes < 0 || end > size_)
    return h;
  if (h.utime < -kLatest || h.utime > kLatest) return h;
  const uint8_t* name = data_ + at + kHeaderBytes;
  if (std::all_of(name, name + h.channel_bytes, [](uint8_t c) { return std::isgraph(c) != 0; }))
    h.size = end - at;
  return h;
}

/// The first event in [from, to) that another, or the end of the file, follows; `to` if there is
/// none.
int64_t LogReader::FindEvent(int64_t from, int64_t to) const {
  for (int64_t at = from; at < to; ++at) {
    const void* sync = memmem(data_ + at, static_cast<size_t>(to - at), kSync, sizeof kSync);
    if (sync == nullptr) break;
    at = static_cast<const uint8_t*>(sync) - data_;
    const Header h = HeaderAt(at);
    if (h.size > 0 && BeginsAt(at + h.size)) return at;
  }
  return to;
}

void LogReader::StepOver(int64_t to) {
  damage_.push_back({at_, to - at_, to == size_});
  at_ = to;
}

bool LogReader::Next(LogEvent* event) {
  const bool found = Find(event);
  if (watch_) watch_(*this);
  return found;
}

bool LogReader::Find(LogEvent* event) {
  while (at_ < size_) {
    const Header h = HeaderAt(at_);
    if (h.size == 0) {
      StepOver(FindEvent(at_ + 1, size_));
      continue;
    }
    const int64_t end = at_ + h.size;
    // What no event follows may have a wrong length, and then holds events itself.
    const int64_t inner = BeginsAt(end) ? end : FindEvent(at_ + 1, end);
    if (inner < end) {
      StepOver(inner);
      continue;
    }
    const uint8_t* name = data_ + at_ + kHeaderBytes;
    event->utime = h.utime;
    event->channel.assign(name, name + h.channel_bytes);
    event->bytes.assign(name + h.channel_bytes, data_ + end);
    at_ = end;
    if (!IsLoopback(event->channel)) return true;
  }
  return false;
}

}  // namespace chase::bus
