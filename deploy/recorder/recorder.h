#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <string>

#include "deploy/recorder/event_file.h"
#include "deploy/recorder/recorder_config.h"

namespace chase::recorder {

/// Which message goes into which log, which logs stay, and what is given up when the disk is full.
/// Times in microseconds, never back by more than the bus does.
class Recorder {
 public:
  /// `name`: of the logs. Throws std::runtime_error, one line, when the first cannot be made.
  Recorder(const RecorderConfig& config, const std::string& name, int64_t utime);
  /// Ends the logs.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void Add(int64_t utime, const std::string& channel, bool heavy, const uint8_t* data, size_t size);
  /// Some times a second, with the bytes that are free on the disk. Puts on disk what came.
  void Tick(int64_t utime, int64_t free_bytes);

  /// Are heavy messages left out because the disk is nearly full?
  bool heavy_given_up() const { return heavy_given_up_; }
  /// Does the disk refuse even light messages?
  bool refused() const { return refused_; }
  /// Messages that were to be recorded and are not.
  int64_t unrecorded() const { return unrecorded_; }
  int64_t light_bytes() const { return light_bytes_ + (light_.file ? light_.file->bytes() : 0); }
  int64_t heavy_bytes() const;
  int files() const { return light_.count; }

 private:
  /// Logs of one kind, one after the other.
  struct Series {
    std::string name;  // what stands before their number
    std::unique_ptr<EventFile> file;
    int count = 0;
    int64_t since = 0, last_utime = 0;
  };
  struct Old {
    std::string name;
    int64_t bytes, last_utime;
  };

  bool Open(int64_t utime, Series* series);
  bool Put(int64_t utime, const std::string& channel, const uint8_t* data, size_t size,
           Series* series);
  void Retire(Series* series);
  bool IsFull(int64_t utime, const Series& series, double minutes) const;
  void DropOldHeavy(int64_t utime);
  void FindEarlierHeavy();
  int64_t DropOldestHeavy();
  static int64_t DropFirst(std::deque<Old>* logs);
  void MindTheDisk();
  void FlushAll(int64_t utime);
  void Refused(int64_t utime, Series* series);

  RecorderConfig config_;
  Series light_, heavy_;
  std::list<std::unique_ptr<EventFile>> ending_;  // no more is written to; the disk takes its time
  std::deque<Old> old_heavy_;                     // of this recorder: dropped once they are old
  std::deque<Old>
      earlier_heavy_;  // of those before it, by file time: the same, and first where room is short
  int64_t light_bytes_ = 0;
  int64_t room_ = INT64_MAX;  // bytes free on the disk, as far as is known
  bool heavy_given_up_ = false, refused_ = false;
  int64_t unrecorded_ = 0, next_try_ = 0;
};

}  // namespace chase::recorder
