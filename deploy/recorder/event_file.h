#pragma once

#include <lcm/eventlog.h>

#include <cstdint>
#include <future>
#include <memory>
#include <string>

namespace chase::recorder {

/// An LCM log that is read as far as it goes while it grows. What the disk refuses leaves no half
/// event behind: the file is cut back to what was flushed last. The end waits for the
/// disk, unless it IsOnDisk().
class EventFile {
 public:
  /// Throws std::runtime_error, one line, when the file cannot be made.
  explicit EventFile(const std::string& name);
  ~EventFile();

  /// False: the disk refused; the events since the last Flush() are gone, and nothing more can be
  /// written into this file.
  bool Write(int64_t utime, const std::string& channel, const uint8_t* data, size_t size);
  /// Hands what was written to the system, which puts it on the disk meanwhile: a slow disk makes
  /// nobody wait, and takes the next flush with it.
  bool Flush();
  /// Is all that was flushed on the disk? Never waits; the end does not either, once it is.
  bool IsOnDisk();

  const std::string& name() const { return name_; }
  int64_t bytes() const { return written_; }
  /// Events that Write() took and a refused disk lost.
  int64_t lost() const { return lost_; }

 private:
  bool GiveUp();
  bool IsSyncing() const;
  void Sync();

  struct Closer {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };
  std::string name_;
  std::unique_ptr<lcm_eventlog_t, Closer> log_;
  int64_t written_ = 0, flushed_ = 0;  // bytes
  int64_t waiting_ = 0, lost_ = 0;     // events
  int64_t synced_ = 0;                 // bytes, once `syncing_` is over
  std::future<void> syncing_;
};

}  // namespace chase::recorder
