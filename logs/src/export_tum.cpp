#include <fmt/format.h>

#include <iterator>
#include <optional>

#include "chase/pose_t.hpp"
#include "chase/target_t.hpp"
#include "chase/truth_t.hpp"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/export.h"
#include "logs/src/good_message.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

constexpr double kNoRotation[4] = {1.0, 0.0, 0.0, 0.0};

/// `q` as w x y z; TUM has x y z w.
std::string Line(int64_t utime, const double* p, const double* q) {
  return fmt::format("{:.6f} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                     static_cast<double>(utime) * 1e-6, p[0], p[1], p[2], q[1], q[2], q[3], q[0]);
}

std::string LineOf(const pose_t& m) { return Line(m.utime, m.pos, m.orientation); }
std::string LineOf(const truth_t& m) { return Line(m.utime, m.pos, m.orientation); }
std::string LineOf(const target_t& m) {
  const bool usable = m.state == target_t::TRACKING || m.state == target_t::OCCLUDED;
  return usable ? Line(m.utime, m.mean, kNoRotation) : "";
}

int32_t EpochOf(const truth_t&) { return 0; }  // of one frame
template <class T>
int32_t EpochOf(const T& m) {
  return m.epoch;
}

/// The epoch of the frame W that they were in so far.
class Frames {
 public:
  void Note(int64_t utime, int32_t epoch) {
    if (epoch_ && *epoch_ != epoch)
      changes_.push_back(fmt::format("frame W changed at {:.6f} s (epoch {})",
                                     static_cast<double>(utime) * 1e-6, epoch));
    epoch_ = epoch;
  }
  const Notes& changes() const { return changes_; }

 private:
  std::optional<int32_t> epoch_;
  Notes changes_;
};

template <class T>
std::string LineOf(const Bytes& bytes, Frames* frames) {
  T message;
  if (!DecodeBytes(bytes, &message)) return "";
  const std::string line = LineOf(message);
  if (!line.empty()) frames->Note(message.utime, EpochOf(message));
  return line;
}

using Liner = std::string (*)(const Bytes&, Frames*);

Liner LinerOf(const std::string& channel) {
  if (IsOn(channel, "POSE")) return LineOf<pose_t>;
  if (IsOn(channel, "TRUTH")) return LineOf<truth_t>;
  if (IsOn(channel, "TARGET")) return LineOf<target_t>;
  throw BadOption("--channel " + channel +
                  ": is no trajectory for --tum; name POSE (the default), TRUTH or TARGET");
}

}  // namespace

long ExportTum(const std::string& log, const std::string& out, const std::string& channel,
               const Watch& watch, Notes* notes) {
  const Liner line_of = LinerOf(channel);
  LogReader reader(log, watch);
  std::string text, found;
  long heard = 0, count = 0;
  Frames frames;
  Unreadable unreadable;
  for (LogEvent e; reader.Next(&e);) {
    if (!IsOn(e, channel)) continue;
    if (found.empty()) found = e.channel;
    if (found != e.channel) RefuseSeveralVehicles(log, channel);
    const std::string line = line_of(e.bytes, &frames);
    unreadable.Add(e);
    ++heard;
    text += line;
    count += !line.empty();
  }
  if (notes) {
    *notes = unreadable.Lines();
    notes->insert(notes->end(), frames.changes().begin(), frames.changes().end());
  }
  if (count == 0 && heard > 0 && IsOn(channel, "TARGET") && unreadable.Lines().empty())
    throw std::runtime_error(fmt::format(
        "{}: none of {} messages of {} is of a target that is tracked", log, heard, channel));
  if (count == 0)
    throw std::runtime_error(log + ": holds no usable " + channel +
                             "; export a log of a flight, see chase-log info");
  WriteFile(out, text);
  return count;
}

}  // namespace chase::logs
