#pragma once

#include <cstdint>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>
#include <vector>

namespace chase::logs {

struct Event {
  int64_t utime = 0;  ///< when it was logged, microseconds
  std::string channel;
  std::vector<uint8_t> bytes;
};

/// Reads an LCM log from its beginning, in file order.
class LogReader {
 public:
  /// Throws std::runtime_error with one line when the file is missing or no LCM log.
  explicit LogReader(const std::string& file);

  /// The next event; false at the end of the log.
  bool Next(Event* event);

  /// After the end: bytes that belong to no whole event (a log cut off while being written).
  int64_t unread_bytes() const { return size_ - read_; }
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::unique_ptr<lcm::LogFile> log_;
  int64_t size_ = 0, read_ = 0;
};

}  // namespace chase::logs
