#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace chase::bus {

/// A stretch of a log that holds no whole event.
struct Damage {
  int64_t at = 0, bytes = 0;
  bool at_end = false;  ///< the log was cut off while being written
};
/// For people.
std::string Format(const Damage& damage);

struct LogEvent {
  int64_t utime = 0;  ///< when it was logged, microseconds
  std::string channel;
  std::vector<uint8_t> bytes;
};

/// The log of a flight's folder, or `flight` itself, which is a log.
std::string LogOf(const std::string& flight);

class LogReader;
/// Hears of every event that was read and of the end: for progress and for what was damaged.
using Watch = std::function<void(const LogReader&)>;

/// Reads an LCM log from its beginning, in file order. Goes on behind what is damaged; leaves out
/// the bus's own packets (IsLoopback).
class LogReader {
 public:
  /// Throws std::runtime_error with one line when the file is missing or no LCM log.
  explicit LogReader(const std::string& file, Watch watch = {});
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// The next event; false at the end of the log.
  bool Next(LogEvent* event);

  /// What was stepped over so far, in file order.
  const std::vector<Damage>& damage() const { return damage_; }
  const std::string& file() const { return file_; }
  int64_t size() const { return size_; }
  /// Where the next event is looked for, bytes from the beginning.
  int64_t position() const { return at_; }
  bool AtEnd() const { return at_ >= size_; }
  /// Reads on from there, a position that an earlier event began at.
  void Seek(int64_t position) { at_ = position; }

 private:
  struct Header;
  bool Find(LogEvent* event);
  Header HeaderAt(int64_t at) const;
  bool BeginsAt(int64_t at) const;
  int64_t FindEvent(int64_t from, int64_t to) const;
  void StepOver(int64_t to);

  std::string file_;
  Watch watch_;
  const uint8_t* data_ = nullptr;
  int64_t size_ = 0, at_ = 0;
  std::vector<Damage> damage_;
};

}  // namespace chase::bus
