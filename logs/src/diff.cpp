#include "logs/src/diff.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

#include "common/bus/message_head.h"
#include "common/logs/log_reader.h"
#include "logs/src/export.h"
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

/// What tells a message from the others of its channel: sender and `seq`, or `utime` (the order and
/// the log's stamp where it has neither); then how many alike came before it.
using Key = std::tuple<std::string, int64_t, long>;
enum Rule { kBySeq, kByUtime, kRules };
using Keys = std::array<Key, kRules>;

/// Names the messages of one channel in the order of the log.
class Namer {
 public:
  Keys Next(const LogEvent& e) {
    const auto head =
        TypeOf(e.bytes).empty() ? std::nullopt : bus::HeadOf(e.bytes.data(), e.bytes.size());
    Keys keys = {Key{"", order_++, 0}, Key{"", e.utime, 0}};
    if (head) {
      auto& starts = starts_[head->sender];
      const size_t start = starts.emplace(head->sender_start, starts.size()).first->second;
      keys[kBySeq] = {fmt::format("{}#{}", head->sender, start), head->seq, 0};
      keys[kByUtime] = {"", head->utime, 0};
    }
    for (size_t rule = 0; rule < kRules; ++rule)
      std::get<2>(keys[rule]) = alike_[rule][keys[rule]]++;
    return keys;
  }

 private:
  int64_t order_ = 0;
  std::map<std::string, std::map<int64_t, size_t>> starts_;  // of each sender, as they come
  std::array<std::map<Key, long>, kRules> alike_;
};

/// The names of a log's messages under every rule, by channel.
using Names = std::map<std::string, std::array<std::set<Key>, kRules>>;

/// What is compared beside the fields of messages.
constexpr std::array kOfEvents = {"count", "event_time", "bytes"};

/// What may be ignored of each channel: the paths of its fields, and the rest that is compared.
using Paths = std::map<std::string, std::vector<std::string>>;

Names NamesIn(const std::string& file, const Watch& watch, Paths* paths) {
  LogReader log(file, watch);
  Names names;
  std::map<std::string, Namer> namers;
  for (LogEvent e; log.Next(&e);) {
    std::vector<std::string>& known = (*paths)[e.channel];
    if (known.empty()) known = PathsOf(e.bytes);
    const Keys keys = namers[e.channel].Next(e);
    for (size_t rule = 0; rule < kRules; ++rule) names[e.channel][rule].insert(keys[rule]);
  }
  return names;
}

std::set<Key> Common(const std::set<Key>& a, const std::set<Key>& b) {
  std::set<Key> common;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(),
                        std::inserter(common, common.end()));
  return common;
}

/// How the messages of one channel find their partners: by the rule that pairs most.
struct Pairing {
  Rule rule = kBySeq;
  std::set<Key> pairs;
  long count_a = 0, count_b = 0;
};

std::map<std::string, Pairing> Pair(const Names& a, const Names& b) {
  std::map<std::string, Pairing> pairings;
  for (const auto& [channel, of_a] : a) {
    const auto of_b = b.find(channel);
    if (of_b == b.end()) continue;
    Pairing& p = pairings[channel];
    p.count_a = static_cast<long>(of_a[kBySeq].size());
    p.count_b = static_cast<long>(of_b->second[kBySeq].size());
    p.pairs = Common(of_a[kBySeq], of_b->second[kBySeq]);
    std::set<Key> by_utime = Common(of_a[kByUtime], of_b->second[kByUtime]);
    if (by_utime.size() <= p.pairs.size()) continue;
    p.rule = kByUtime;
    p.pairs = std::move(by_utime);
  }
  return pairings;
}

bool Ignored(const std::vector<std::string>& ignore, const std::string& channel,
             const std::string& path) {
  const std::string name = channel + "." + path;
  return std::any_of(ignore.begin(), ignore.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), name.c_str(), 0) == 0 ||
           fnmatch(pattern.c_str(), channel.c_str(), 0) == 0;
  });
}

/// Channels of A that B lacks.
std::vector<std::string> OnlyIn(const Names& a, const Names& b,
                                const std::vector<std::string>& ignore) {
  std::vector<std::string> only;
  for (const auto& [channel, keys] : a)
    if (b.count(channel) == 0 && !Ignored(ignore, channel, "count")) only.push_back(channel);
  return only;
}

class Comparison {
 public:
  Comparison(std::vector<std::string> ignore, double tolerance,
             const std::map<std::string, Pairing>& pairings)
      : ignore_(std::move(ignore)), tolerance_(tolerance), pairings_(pairings) {
    for (const auto& [channel, p] : pairings) {
      const auto pairs = static_cast<long>(p.pairs.size());
      const bool lost = p.count_a > pairs || p.count_b > pairs;
      if (lost && !Ignored(ignore_, channel, "count")) result_[channel];
    }
  }

  void AddPair(const LogEvent& a, const LogEvent& b) {
    index_ = compared_[a.channel]++;
    channel_ = a.channel;
    if (a.utime != b.utime)
      Note("event_time", {static_cast<double>(std::abs(a.utime - b.utime)),
                          fmt::format("{} against {}", a.utime, b.utime)});
    if (a.bytes != b.bytes) ComparePayload(a.bytes, b.bytes);
  }

  std::map<std::string, ChannelDifference> Take() {
    for (auto& [channel, d] : result_) {
      const Pairing& p = pairings_.at(channel);
      const auto pairs = static_cast<long>(p.pairs.size());
      d.count_a = p.count_a;
      d.count_b = p.count_b;
      d.only_a = p.count_a - pairs;
      d.only_b = p.count_b - pairs;
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

  void Note(const std::string& path, const Change& change) {
    if (Ignored(ignore_, channel_, path)) return;
    FieldDifference& d = result_[channel_].fields[path];
    if (d.messages++ == 0) {
      d.first = index_;
      d.first_values = change.values;
    }
    d.greatest = std::max(d.greatest, change.greatest);
  }

  std::vector<std::string> ignore_;
  double tolerance_;
  const std::map<std::string, Pairing>& pairings_;
  std::map<std::string, long> compared_;
  std::map<std::string, ChannelDifference> result_;
  std::string channel_;
  long index_ = 0;
};

/// One of the two logs, and its messages that wait for their partners in the other.
struct Side {
  explicit Side(const std::string& file) : log(file) {}
  LogReader log;
  bool more = true;
  std::map<std::string, Namer> namers;
  std::map<std::string, std::map<Key, LogEvent>> waiting;
};

/// Takes the next event of `own`; returns its partner if that has come already.
std::optional<std::pair<LogEvent, LogEvent>> Step(const std::map<std::string, Pairing>& pairings,
                                                  Side* own, Side* other) {
  LogEvent e;
  if (!own->more || !(own->more = own->log.Next(&e))) return std::nullopt;
  const auto pairing = pairings.find(e.channel);
  if (pairing == pairings.end()) return std::nullopt;
  const Key key = own->namers[e.channel].Next(e)[pairing->second.rule];
  if (pairing->second.pairs.count(key) == 0) return std::nullopt;
  auto& partners = other->waiting[e.channel];
  const auto partner = partners.find(key);
  if (partner == partners.end()) {
    own->waiting[e.channel].emplace(key, std::move(e));
    return std::nullopt;
  }
  std::pair<LogEvent, LogEvent> pair(std::move(e), std::move(partner->second));
  partners.erase(partner);
  return pair;
}

/// What all of these channels have, for people.
std::string Listed(const Paths& held) {
  std::vector<std::string> common = held.begin()->second;
  for (const auto& [channel, paths] : held) {
    const auto lacks = [&, &has = paths](const std::string& path) {
      return std::find(has.begin(), has.end(), path) == has.end();
    };
    common.erase(std::remove_if(common.begin(), common.end(), lacks), common.end());
  }
  return fmt::format("{} has {}", held.size() == 1 ? held.begin()->first : "each channel",
                     fmt::join(common, ", "));
}

/// `pattern`: CHANNEL or CHANNEL.field, either part a shell pattern.
void RequireHeld(const std::string& pattern, const Paths& all) {
  const size_t point = pattern.find('.');
  const std::string name = pattern.substr(0, point);
  Paths held;
  for (const auto& [channel, paths] : all)
    if (fnmatch(name.c_str(), channel.c_str(), 0) == 0) held[channel] = paths;
  if (held.empty())
    throw BadOption("--ignore " + pattern +
                    ": neither log holds that; chase-log info lists channels");
  bool fits = point == std::string::npos;
  for (const auto& [channel, paths] : held)
    for (const std::string& path : paths) fits = fits || Ignored({pattern}, channel, path);
  if (!fits) throw BadOption("--ignore " + pattern + ": there is no such field; " + Listed(held));
}

}  // namespace

Differences Diff(const std::string& a, const std::string& b, const std::vector<std::string>& ignore,
                 double tolerance, const Watch& watch) {
  Paths paths;
  const Names names_a = NamesIn(a, watch, &paths), names_b = NamesIn(b, watch, &paths);
  for (auto& [channel, known] : paths)
    known.insert(known.end(), kOfEvents.begin(), kOfEvents.end());
  for (const std::string& pattern : ignore) RequireHeld(pattern, paths);
  const auto pairings = Pair(names_a, names_b);
  if (pairings.empty())
    throw std::runtime_error(a + " and " + b + ": have no channel in common; compare others");
  const auto ignored = [&](const auto& pairing) { return Ignored(ignore, pairing.first, ""); };
  if (std::all_of(pairings.begin(), pairings.end(), ignored))
    throw BadOption("--ignore: leaves nothing to compare of what " + a + " and " + b +
                    " have in common; ignore less");
  Comparison comparison(ignore, tolerance, pairings);
  Side side_a(a), side_b(b);
  while (side_a.more || side_b.more) {
    if (const auto pair = Step(pairings, &side_a, &side_b))
      comparison.AddPair(pair->first, pair->second);
    if (const auto pair = Step(pairings, &side_b, &side_a))
      comparison.AddPair(pair->second, pair->first);
  }
  return {comparison.Take(), OnlyIn(names_a, names_b, ignore), OnlyIn(names_b, names_a, ignore)};
}

std::string Format(const Differences& differences) {
  std::string text;
  for (const auto& [side, only] : {std::pair("A", &differences.only_a), {"B", &differences.only_b}})
    if (!only->empty()) text += fmt::format("only in {}: {}\n", side, fmt::join(*only, ", "));
  if (differences.channels.empty()) return text + "no difference\n";
  for (const auto& [channel, d] : differences.channels) {
    text += fmt::format("{}: {} messages against {}", channel, d.count_a, d.count_b);
    if (d.only_a > 0) text += fmt::format("; {} of A are not in B", d.only_a);
    if (d.only_b > 0) text += fmt::format("; {} of B are not in A", d.only_b);
    text += "\n";
    for (const auto& [path, f] : d.fields)
      text += fmt::format("  {}: {} messages differ, by up to {:.6g}; first in pair {}: {}\n", path,
                          f.messages, f.greatest, f.first, f.first_values);
  }
  return text;
}

}  // namespace chase::logs
