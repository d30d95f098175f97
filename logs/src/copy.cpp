#include "logs/src/copy.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <memory>
#include <set>
#include <tuple>

#include "common/bus/log_writer.h"
#include "common/bus/message_head.h"
#include "common/logs/message_types.h"
#include "logs/src/export.h"
#include "logs/src/message_fields.h"

namespace chase::logs {
namespace {

bool Fits(const std::string& pattern, const std::string& channel) {
  return fnmatch(pattern.c_str(), channel.c_str(), 0) == 0;
}

bool FitsAny(const std::vector<std::string>& patterns, const std::string& channel) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& p) { return Fits(p, channel); });
}

/// The first pattern that fits none of the channels; empty: all fit one.
std::string Idle(const Selection& s, const std::set<std::string>& channels) {
  for (const auto* patterns : {&s.keep, &s.drop})
    for (const std::string& p : *patterns)
      if (std::none_of(channels.begin(), channels.end(),
                       [&](const std::string& c) { return Fits(p, c); }))
        return p;
  return "";
}

bool IsMalformed(const Bytes& bytes) {
  bool good = TypeOf(bytes).empty();  // not ours: nobody here can tell
  WithMessage(bytes, [&](const auto&) { good = true; });
  return !good;
}

/// A log that is merged, with the event that is next.
struct Source {
  Source(const std::string& file, const Watch& watch) : log(file, watch) { Step(); }
  void Step() { more = log.Next(&next); }
  LogReader log;
  LogEvent next;
  bool more = false;
};

using Name = std::tuple<std::string, std::string, std::string, int64_t, int32_t>;

/// Knows which log a message was first seen in.
class Repeats {
 public:
  bool Has(const LogEvent& e, size_t log) {
    if (TypeOf(e.bytes).empty()) return false;
    const auto head = bus::HeadOf(e.bytes.data(), e.bytes.size());
    if (!head) return false;
    const Name name{e.channel, head->sender, head->vehicle, head->sender_start, head->seq};
    return seen_.emplace(name, log).first->second != log;
  }

 private:
  std::map<Name, size_t> seen_;
};

}  // namespace

Copied CopySelected(const std::string& in, const std::string& out, const Selection& s,
                    const Watch& watch) {
  LogReader log(in, watch);
  bus::LogWriter writer(out);
  Copied copied;
  std::set<std::string> channels;
  int64_t first = 0, last = 0;
  for (LogEvent e; log.Next(&e);) {
    if (copied.read++ == 0) first = last = e.utime;
    last = std::max(last, e.utime);
    channels.insert(e.channel);
    const double t = 1e-6 * static_cast<double>(e.utime - first);
    if (t < s.from || t >= s.to || FitsAny(s.drop, e.channel)) continue;
    if (!s.keep.empty() && !FitsAny(s.keep, e.channel)) continue;
    writer.Write(e.utime, e.channel, e.bytes);
    ++copied.written;
  }
  const std::string idle = Idle(s, channels);
  if (!idle.empty())
    throw BadOption(fmt::format(
        "--keep/--drop {}: fits no channel of {}; chase-log info lists them", idle, in));
  if (copied.written == 0)
    throw BadOption(fmt::format(
        "{}: nothing of it is selected, it lasts {:.3f} s; mend --from, --to, --keep or --drop", in,
        1e-6 * static_cast<double>(last - first)));
  writer.Close();
  return copied;
}

Copied Repair(const std::string& in, const std::string& out, const Watch& watch) {
  LogReader log(in, watch);
  bus::LogWriter writer(out);
  Copied copied;
  for (LogEvent e; log.Next(&e); ++copied.read) {
    if (IsMalformed(e.bytes)) {
      ++copied.malformed[e.channel];
      continue;
    }
    writer.Write(e.utime, e.channel, e.bytes);
    ++copied.written;
  }
  writer.Close();
  return copied;
}

Copied Merge(const std::vector<std::string>& in, const std::string& out, const Watch& watch) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& file : in) sources.push_back(std::make_unique<Source>(file, watch));
  bus::LogWriter writer(out);
  Copied copied;
  Repeats repeats;
  for (;; ++copied.read) {
    const auto at =
        std::min_element(sources.begin(), sources.end(), [](const auto& a, const auto& b) {
          return a->more && (!b->more || a->next.utime < b->next.utime);
        });
    Source& source = **at;
    if (!source.more) break;
    if (repeats.Has(source.next, static_cast<size_t>(at - sources.begin()))) {
      ++copied.repeated;
    } else {
      writer.Write(source.next.utime, source.next.channel, source.next.bytes);
      ++copied.written;
    }
    source.Step();
  }
  writer.Close();
  return copied;
}

std::string Format(const Copied& c) {
  std::string text = fmt::format("{} of {} messages\n", c.written, c.read);
  for (const auto& [channel, count] : c.malformed)
    text += fmt::format("{}: {} messages do not decode and were left out\n", channel, count);
  if (c.repeated > 0) text += fmt::format("{} messages were in several logs\n", c.repeated);
  return text;
}

}  // namespace chase::logs
