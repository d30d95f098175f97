#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/logs/log_reader.h"

namespace chase::viewer {

/// A bus that hands over what a flight log holds, from any moment on. What is published is lost.
/// Its time is the log's as if nobody had set the clock; other jumps of it last one tick each.
class LogPlayer : public bus::Bus {
 public:
  /// Reads the whole log once to know where its events are. Throws std::runtime_error with one
  /// line.
  explicit LogPlayer(const std::string& file);

  int64_t begin() const { return index_.front().utime; }  ///< us, the log's first stamp
  int64_t end() const { return index_.back().utime; }
  int64_t Now() const override { return now_; }
  /// The file's name for those who look on, what of it is lost, and the count of jumps that are not
  /// played.
  std::string Title() const;

  /// Hands over all light messages (throws std::runtime_error if nobody listens to any channel of
  /// the log) and calls `every` at multiples of `period` microseconds, until it returns false.
  void Survey(int64_t period, const std::function<bool(int64_t utime)>& every);
  /// Hands over, of each channel, the last message up to `utime`, in file order; heavy ones last,
  /// so that an image finds the target that is drawn into it. Of images also the last before
  /// TARGET, for the newest may not have its own yet.
  void Seek(int64_t utime);
  /// Hands over what follows up to `utime`; of each heavy channel only the last.
  void PlayTo(int64_t utime);

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override;
  void PublishRaw(const std::string&, Bytes) override {}

 private:
  struct Entry {
    int64_t utime, position;  // utime never goes back
    size_t channel;
  };
  /// The time at which what has this stamp is played, after all that is in the index.
  int64_t PlayingTime(int64_t stamp);
  void HandOver(const Entry& entry);
  /// Per channel the last of the entries [from, to); SIZE_MAX: none.
  std::vector<size_t> LastOfEach(size_t from, size_t to) const;
  size_t After(int64_t utime) const;

  logs::LogReader reader_;
  logs::LogEvent event_;
  std::vector<logs::Damage> damage_;
  std::vector<std::string> channels_;
  std::vector<RawHandler> handlers_;  // by channel; empty: nobody listens
  std::vector<bool> heavy_;
  size_t image_ = SIZE_MAX, target_ = SIZE_MAX;  // CAMERA_IMAGE and TARGET among the channels
  std::vector<Entry> index_;
  size_t next_ = 0;
  int64_t now_ = 0;
  int64_t left_out_ = 0;  // us of the log's clock up to the end of the index
  int jumps_ = 0;
};

}  // namespace chase::viewer
