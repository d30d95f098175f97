#include "logs/src/diff.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "logs/src/info.h"
#include "logs/src/log_reader.h"
#include "logs/src/message_fields.h"

namespace chase::logs {
namespace {

bool SameNumber(double a, double b, double tolerance) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return true;
  return std::abs(a - b) <= tolerance * std::max({1.0, std::abs(a), std::abs(b)});
}

std::string Show(const Field& f, size_t index) {
  if (index < f.texts.size()) return "'" + f.texts[index].substr(0, 60) + "'";
  if (index < f.numbers.size()) return fmt::format("{}", f.numbers[index]);
  return fmt::format("{} values", std::max(f.numbers.size(), f.texts.size()));
}

struct Change {
  double greatest = 0.0;
  std::string values;
};

Change SizeChange(const Field& a, const Field& b) {
  return {0.0, fmt::format("{} values against {}", a.numbers.size() + a.texts.size(),
                           b.numbers.size() + b.texts.size())};
}

std::optional<Change> Compare(const Field& a, const Field& b, double tolerance) {
  if (a.numbers.size() != b.numbers.size() || a.texts.size() != b.texts.size())
    return SizeChange(a, b);
  std::optional<Change> change;
  const auto note = [&](size_t i) {
    if (!change) change = Change{0.0, Show(a, i) + " against " + Show(b, i)};
  };
  for (size_t i = 0; i < a.numbers.size(); ++i) {
    if (SameNumber(a.numbers[i], b.numbers[i], tolerance)) continue;
    note(i);
    const double d = std::abs(a.numbers[i] - b.numbers[i]);
    change->greatest = std::isnan(d) ? INFINITY : std::max(change->greatest, d);
  }
  for (size_t i = 0; i < a.texts.size(); ++i)
    if (a.texts[i] != b.texts[i]) note(i);
  return change;
}

using CountMap = std::map<std::string, long>;

class Comparison {
 public:
  Comparison(std::vector<std::string> ignore, double tolerance, CountMap a, CountMap b)
      : ignore_(std::move(ignore)),
        tolerance_(tolerance),
        counts_a_(std::move(a)),
        counts_b_(std::move(b)) {
    CountMap all = counts_a_;
    all.insert(counts_b_.begin(), counts_b_.end());
    for (const auto& [channel, count] : all) {
      common_[channel] = std::min(counts_a_[channel], counts_b_[channel]);
      if (counts_a_[channel] != counts_b_[channel] && !Ignored(channel, "count")) result_[channel];
    }
  }

  /// Messages of each channel that have a partner.
  const CountMap& common() const { return common_; }

  void AddPair(const Event& a, const Event& b) {
    index_ = compared_[a.channel]++;
    channel_ = a.channel;
    if (a.utime != b.utime)
      Note("event_time", {static_cast<double>(std::abs(a.utime - b.utime)),
                          fmt::format("{} against {}", a.utime, b.utime)});
    if (a.bytes != b.bytes) ComparePayload(a.bytes, b.bytes);
  }

  std::map<std::string, ChannelDifference> Take() {
    for (auto& [channel, d] : result_) {
      d.count_a = counts_a_[channel];
      d.count_b = counts_b_[channel];
    }
    return std::move(result_);
  }

 private:
  void ComparePayload(const Bytes& a, const Bytes& b) {
    const auto fields_a = FieldsOf(a), fields_b = FieldsOf(b);
    if (!fields_a || !fields_b)
      return Note("bytes", {0.0, fmt::format("{} bytes against {} that differ; not decoded",
                                             a.size(), b.size())});
    std::map<std::string, const Field*> in_b;
    for (const Field& f : *fields_b) in_b[f.path] = &f;
    for (const Field& f : *fields_a) {
      const auto at = in_b.find(f.path);
      const Field none{f.path, {}, {}, f.is_list};
      if (const auto change = Compare(f, at == in_b.end() ? none : *at->second, tolerance_))
        Note(f.path, *change);
      if (at != in_b.end()) in_b.erase(at);
    }
    for (const auto& [path, field] : in_b) Note(path, SizeChange({path, {}, {}, true}, *field));
  }

  bool Ignored(const std::string& channel, const std::string& path) const {
    const std::string name = channel + "." + path;
    return std::any_of(ignore_.begin(), ignore_.end(), [&](const std::string& pattern) {
      return fnmatch(pattern.c_str(), name.c_str(), 0) == 0 || pattern == channel;
    });
  }

  void Note(const std::string& path, const Change& change) {
    if (Ignored(channel_, path)) return;
    FieldDifference& d = result_[channel_].fields[path];
    if (d.messages++ == 0) {
      d.first = index_;
      d.first_values = change.values;
    }
    d.greatest = std::max(d.greatest, change.greatest);
  }

  std::vector<std::string> ignore_;
  double tolerance_;
  CountMap counts_a_, counts_b_, common_, compared_;
  std::map<std::string, ChannelDifference> result_;
  std::string channel_;
  long index_ = 0;
};

/// One of the two logs: how many messages of each channel it has given, and those that wait for
/// their partner in the other.
struct Side {
  explicit Side(const std::string& file) : log(file) {}
  LogReader log;
  bool more = true;
  CountMap given;
  std::map<std::string, std::deque<Event>> waiting;
};

CountMap Counts(const std::string& file) {
  CountMap counts;
  for (const ChannelInfo& c : Describe(file).channels) counts[c.channel] = c.count;
  return counts;
}

/// Takes the next event of `own`; returns its partner if that has come already.
std::optional<std::pair<Event, Event>> Step(const CountMap& common, Side* own, Side* other) {
  Event e;
  if (!own->more || !(own->more = own->log.Next(&e))) return std::nullopt;
  const auto limit = common.find(e.channel);
  if (limit == common.end() || own->given[e.channel]++ >= limit->second) return std::nullopt;
  auto& partners = other->waiting[e.channel];
  if (partners.empty()) {
    own->waiting[e.channel].push_back(std::move(e));
    return std::nullopt;
  }
  std::pair<Event, Event> pair(std::move(e), std::move(partners.front()));
  partners.pop_front();
  return pair;
}

}  // namespace

std::map<std::string, ChannelDifference> Diff(const std::string& a, const std::string& b,
                                              const std::vector<std::string>& ignore,
                                              double tolerance) {
  const auto counts_a = Counts(a), counts_b = Counts(b);
  Comparison comparison(ignore, tolerance, counts_a, counts_b);
  Side side_a(a), side_b(b);
  while (side_a.more || side_b.more) {
    if (const auto pair = Step(comparison.common(), &side_a, &side_b))
      comparison.AddPair(pair->first, pair->second);
    if (const auto pair = Step(comparison.common(), &side_b, &side_a))
      comparison.AddPair(pair->second, pair->first);
  }
  return comparison.Take();
}

std::string Format(const std::map<std::string, ChannelDifference>& differences) {
  std::string text;
  for (const auto& [channel, d] : differences) {
    text += fmt::format("{}: {} messages against {}\n", channel, d.count_a, d.count_b);
    for (const auto& [path, f] : d.fields)
      text += fmt::format("  {}: {} messages differ, by up to {:.6g}; first in message {}: {}\n",
                          path, f.messages, f.greatest, f.first, f.first_values);
  }
  return text;
}

}  // namespace chase::logs
