#include "logs/src/diff.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "logs/src/log_reader.h"
#include "logs/src/message_fields.h"

namespace chase::logs {
namespace {

bool SameNumber(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

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

std::optional<Change> Compare(const Field& a, const Field& b) {
  if (a.numbers.size() != b.numbers.size() || a.texts.size() != b.texts.size())
    return SizeChange(a, b);
  std::optional<Change> change;
  const auto note = [&](size_t i) {
    if (!change) change = Change{0.0, Show(a, i) + " against " + Show(b, i)};
  };
  for (size_t i = 0; i < a.numbers.size(); ++i) {
    if (SameNumber(a.numbers[i], b.numbers[i])) continue;
    note(i);
    const double d = std::abs(a.numbers[i] - b.numbers[i]);
    change->greatest = std::isnan(d) ? INFINITY : std::max(change->greatest, d);
  }
  for (size_t i = 0; i < a.texts.size(); ++i)
    if (a.texts[i] != b.texts[i]) note(i);
  return change;
}

class Comparison {
 public:
  explicit Comparison(std::vector<std::string> ignore) : ignore_(std::move(ignore)) {}

  void AddPair(const Event& a, const Event& b) {
    index_ = counts_[a.channel]++;
    channel_ = a.channel;
    if (a.utime != b.utime)
      Note("event_time", {static_cast<double>(std::abs(a.utime - b.utime)),
                          fmt::format("{} against {}", a.utime, b.utime)});
    if (a.bytes != b.bytes) ComparePayload(a.bytes, b.bytes);
  }

  void AddSurplus(const std::string& channel, long in_a, long in_b) {
    if (Ignored(channel, "count")) return;
    result_[channel].count_a = counts_[channel] + in_a;
    result_[channel].count_b = counts_[channel] + in_b;
  }

  std::map<std::string, ChannelDifference> Take() {
    for (auto& [channel, d] : result_)
      if (d.count_a == 0 && d.count_b == 0) d.count_a = d.count_b = counts_[channel];
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
      if (const auto change = Compare(f, at == in_b.end() ? none : *at->second))
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
  std::map<std::string, long> counts_;
  std::map<std::string, ChannelDifference> result_;
  std::string channel_;
  long index_ = 0;
};

/// Events of one log that wait for their partner in the other.
using Waiting = std::map<std::string, std::deque<Event>>;

void Match(Event event, bool from_a, Waiting* own, Waiting* other, Comparison* comparison) {
  auto& partners = (*other)[event.channel];
  if (partners.empty()) {
    (*own)[event.channel].push_back(std::move(event));
    return;
  }
  if (from_a)
    comparison->AddPair(event, partners.front());
  else
    comparison->AddPair(partners.front(), event);
  partners.pop_front();
}

void NoteSurplus(const Waiting& a, const Waiting& b, Comparison* comparison) {
  std::map<std::string, std::pair<long, long>> surplus;
  for (const auto& [channel, events] : a) surplus[channel].first = static_cast<long>(events.size());
  for (const auto& [channel, events] : b)
    surplus[channel].second = static_cast<long>(events.size());
  for (const auto& [channel, n] : surplus)
    if (n.first != n.second) comparison->AddSurplus(channel, n.first, n.second);
}

}  // namespace

std::map<std::string, ChannelDifference> Diff(const std::string& a, const std::string& b,
                                              const std::vector<std::string>& ignore) {
  LogReader log_a(a), log_b(b);
  Comparison comparison(ignore);
  Waiting waiting_a, waiting_b;
  bool more_a = true, more_b = true;
  while (more_a || more_b) {
    Event e;
    if (more_a && (more_a = log_a.Next(&e)))
      Match(std::move(e), true, &waiting_a, &waiting_b, &comparison);
    if (more_b && (more_b = log_b.Next(&e)))
      Match(std::move(e), false, &waiting_b, &waiting_a, &comparison);
  }
  NoteSurplus(waiting_a, waiting_b, &comparison);
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
