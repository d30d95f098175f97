#include "logs/src/info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "chase/scenario_t.hpp"
#include "chase/status_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/channels.h"
#include "common/bus/message_head.h"
#include "common/bus/status.h"
#include "common/logs/message_types.h"
#include "logs/src/good_message.h"
#include "logs/src/log_survey.h"
#include "logs/src/message_fields.h"

namespace chase::logs {
namespace {

constexpr double kTolerableShare = 0.01;                     // of messages: see LogInfo::Recorded
constexpr int64_t kGapPeriods = 10, kShortestGap = 100'000;  // us; a shorter gap is not told
constexpr int64_t kYear2000 = 946684800LL * 1000000;         // us; before it: logical time

double Seconds(int64_t utime) { return static_cast<double>(utime) * 1e-6; }

/// What may be left out of a recording.
bool HeavyUnderAnyPrefix(const std::string& channel) {
  const auto& table = bus::ChannelTable();
  return std::any_of(table.begin(), table.end(), [&](const bus::ChannelRow& row) {
    return row.heavy && IsOn(channel, row.channel);
  });
}

std::string Line(const ChannelInfo& c) {
  return fmt::format("{:<20} {:<20} {:>8} {:>8.2f} Hz {:>12} {:>18.6f} {:>18.6f} {:>8} {:>9.3f}\n",
                     c.channel, c.type.empty() ? "-" : c.type, c.count, c.RateHz(), c.bytes,
                     Seconds(c.first_utime), Seconds(c.last_utime),
                     c.senders.empty() ? "-" : std::to_string(c.missing), Seconds(c.longest_gap));
}

/// Processes of the same value in one place.
std::string ByValue(const std::map<std::string, std::string>& values) {
  std::map<std::string, std::string> processes;
  for (const auto& [process, value] : values)
    processes[value] += (processes[value].empty() ? "" : ", ") + process;
  std::string text;
  for (const auto& [value, names] : processes)
    text += fmt::format("{}{} ({})", text.empty() ? "" : "; ", value, names);
  return text;
}

/// Of the log's events, microseconds; the first is the later one where there are none.
std::pair<int64_t, int64_t> Span(const LogInfo& info) {
  int64_t first = INT64_MAX, last = 0;
  for (const ChannelInfo& c : info.channels) {
    if (c.count == 0) continue;
    first = std::min(first, c.first_utime);
    last = std::max(last, c.last_utime);
  }
  return {first, last};
}

std::string Recorded(const LogInfo& info) {
  const auto [first, last] = Span(info);
  const std::string length = fmt::format("{:.1f} s", Seconds(last - first)), utc = info.Utc();
  return utc.empty() ? length + " of logical time (flown in lockstep, or imported)"
                     : utc + " UTC, " + length;
}

std::string Head(const LogInfo& info) {
  const auto [first, last] = Span(info);
  std::string text = fmt::format("log        {}, {} bytes\n", info.file, info.bytes);
  if (first <= last) text += "recorded   " + Recorded(info) + "\n";
  if (!info.scenario.empty()) text += "scenario   " + info.scenario + "\n";
  for (const std::string& line : info.Software()) text += line + "\n";
  return text + "\n";
}

}  // namespace

double ChannelInfo::RateHz() const {
  const double span = Seconds(last_utime - first_utime);
  return span > 0.0 ? static_cast<double>(count - 1) / span : 0.0;
}

double ChannelInfo::MissingShare() const {
  return missing > 0 ? static_cast<double>(missing) / static_cast<double>(missing + count) : 0.0;
}

std::string LogInfo::Utc() const {
  const auto [first, last] = Span(*this);
  if (first < kYear2000 || first > last) return "";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(first / 1000000));
}

std::vector<std::string> LogInfo::Software() const {
  std::vector<std::string> lines;
  if (!versions.empty()) lines.push_back("versions   " + ByValue(versions));
  if (!hosts.empty()) lines.push_back("host       " + ByValue(hosts));
  std::string sums;
  for (const auto& [process, sum] : configurations)
    sums += fmt::format("{}{} {}", sums.empty() ? "" : ", ", process, sum);
  if (!sums.empty())
    lines.push_back("configuration (cksum of --dump-config)  " + sums);
  else if (!versions.empty())
    lines.push_back("configuration  not told: by an older version");
  return lines;
}

std::map<std::string, TextByProcess> LogInfo::SoftwareByKind() const {
  return {{"versions", versions}, {"hosts", hosts}, {"configurations", configurations}};
}

void LogInfo::RequireOneVehicle() const {
  OneVehicle vehicle(file);
  for (const ChannelInfo& c : channels)
    if (c.count > 0) vehicle.Hear(c.channel);
}

bool LogInfo::Recorded() const {
  const auto tolerable = [this](ChannelInfo c) {
    if (c.unreadable > 0) return false;
    if (!HeavyUnderAnyPrefix(c.channel)) return c.missing == 0;
    c.missing -= c.missing_first;
    return c.MissingShare() <= kTolerableShare || heavy_left_out;
  };
  return Whole() && std::all_of(channels.begin(), channels.end(), tolerable);
}

std::vector<std::string> LogInfo::Losses() const {
  std::vector<std::string> lines;
  for (const ChannelInfo& c : channels) {
    if (c.unreadable > 0) lines.push_back(UnreadableLine(c.channel, c.unreadable));
    if (c.missing > 0 && c.count == 0)
      lines.push_back(fmt::format("{}: others heard {} message{}, the log holds none", c.channel,
                                  c.missing, c.missing == 1 ? "" : "s"));
    for (const SenderInfo& s : c.senders)
      if (s.missing > 0)
        lines.push_back(fmt::format(
            "{}: {} of {} messages of {} are missing ({:.1f} %)", c.channel, s.missing,
            s.missing + s.count, s.name,
            100.0 * static_cast<double>(s.missing) / static_cast<double>(s.missing + s.count)));
    if (c.missing > 0 && c.period > 0 &&
        c.longest_gap >= std::max(kShortestGap, kGapPeriods * c.period))
      lines.push_back(fmt::format(
          "{}: longest gap {:.2f} s, from {:.1f} s of the log on; its period is {:.3f} s",
          c.channel, Seconds(c.longest_gap), Seconds(c.gap_begins), Seconds(c.period)));
  }
  for (const ClockStep& step : clock_steps)
    lines.push_back(fmt::format("clock stepped by {:+.1f} s at {:.1f} s of the log",
                                Seconds(step.by), Seconds(step.at)));
  for (const auto& [process, count] : restarts)
    lines.push_back(fmt::format("{}: started anew, {}", process,
                                count == 1 ? "once" : fmt::format("{} times", count)));
  for (const Damage& d : damage) lines.push_back(Format(d));
  return lines;
}

void LogSurvey::Add(const LogEvent& e) {
  Channel& channel = channels_[e.channel];
  ChannelInfo& c = channel.info;
  const int64_t utime = clock_.Add(e);
  if (c.count++ == 0) {
    c.channel = e.channel;
    c.first_utime = c.last_utime = channel.previous = utime;
  }
  first_utime_ = std::min(first_utime_, utime);
  last_utime_ = std::max(last_utime_, utime);
  c.bytes += static_cast<int64_t>(e.bytes.size());
  c.first_utime = std::min(c.first_utime, utime);  // live logs may step back by a millisecond
  c.last_utime = std::max(c.last_utime, utime);
  NoteGap(utime, &channel);
  channel.previous = utime;
  if (IsUnreadable(e)) return void(++c.unreadable);
  const std::string type = TypeOf(e.bytes);
  if (type.empty()) return;
  if (c.type.empty()) c.type = type;
  AddHead(e, &channel);
  AddContent(e, type);
}

std::string UnreadableLine(const std::string& channel, long count) {
  return fmt::format(
      "{}: {} message{} cannot be read (of another version, or damaged; see chase-log migrate)",
      channel, count, count == 1 ? "" : "s");
}

void LogSurvey::NoteGap(int64_t until, Channel* channel) const {
  ChannelInfo& c = channel->info;
  const int64_t gap = until - channel->previous;
  if (gap <= c.longest_gap) return;
  c.longest_gap = gap;
  c.gap_begins = channel->previous - first_utime_;
}

void LogSurvey::AddHead(const LogEvent& e, Channel* channel) {
  const auto head = bus::HeadOf(e.bytes.data(), e.bytes.size());
  if (!head) return;
  auto& [count, seqs] = channel->senders[{head->sender, head->vehicle, head->sender_start}];
  if (count++ == 0) heard_.erase(e.channel);  // that was of an earlier life
  seqs.Add(head->seq);
  for (const auto& [name, seq] : head->inputs) {
    if (name == bus::Bus::kTick) continue;  // no message
    auto& heard = heard_.try_emplace(head->vehicle + name, Heard{seq, seq}).first->second;
    heard = {std::min(heard.first, seq), std::max(heard.last, seq)};
  }
}

void LogSurvey::AddContent(const LogEvent& e, const std::string& type) {
  status_t status;
  scenario_t scenario;
  if (type == "status_t" && DecodeBytes(e.bytes, &status)) {
    const bus::Software software = bus::SoftwareOf(status.version);
    if (!software.configuration.empty()) info_.configurations[status.name] = software.configuration;
    if (!software.host.empty()) info_.hosts[status.name] = software.host;
    info_.versions[status.name] = software.version;
    info_.heavy_left_out |= status.name == "recorder" && status.state == status_t::DEGRADED;
    starts_[status.vehicle + status.name].insert(status.sender_start);
  }
  if (type == "scenario_t" && info_.scenario.empty() && DecodeBytes(e.bytes, &scenario))
    info_.scenario = fmt::format("{}, seed {}", scenario.name, scenario.seed);
}

/// A process that started while the log was written counts from 0 (Bus::Publish); what others heard
/// behind its last message was sent, too.
void LogSurvey::Settle(Channel* channel) const {
  ChannelInfo& info = channel->info;
  const auto heard = heard_.find(info.channel);
  const bool told = heard != heard_.end() && channel->senders.size() == 1;
  if (info.count > 1) NoteGap(last_utime_, channel);
  info.period = clock_.Period(info.channel);
  for (const auto& [key, value] : channel->senders) {
    const auto& [name, vehicle, start] = key;
    const auto& [count, seqs] = value;
    const int64_t before = start >= first_utime_ ? std::max(0, seqs.first()) : 0;
    const int64_t behind = told && !HeavyUnderAnyPrefix(info.channel)
                               ? std::max<int64_t>(0, int64_t{heard->second.last} - seqs.last())
                               : 0;
    const std::string shown = name.empty() ? "an unnamed sender" : name;
    info.senders.push_back({shown, count, before + seqs.missing() + behind});
    info.missing += info.senders.back().missing;
    info.missing_first += before;
  }
}

void LogSurvey::AddUnrecorded(LogInfo* info) const {
  for (const auto& [name, heard] : heard_) {
    if (channels_.count(name) > 0 || HeavyUnderAnyPrefix(name)) continue;
    ChannelInfo c;
    c.channel = name;
    c.missing = int64_t{heard.last} - heard.first + 1;
    info->channels.push_back(std::move(c));
  }
}

LogInfo LogSurvey::Take(const LogReader& log) {
  for (auto& [name, channel] : channels_) {
    Settle(&channel);
    info_.channels.push_back(std::move(channel.info));
  }
  for (const auto& [process, starts] : starts_)
    if (starts.size() > 1) info_.restarts[process] = static_cast<int>(starts.size()) - 1;
  AddUnrecorded(&info_);
  std::sort(info_.channels.begin(), info_.channels.end(),
            [](const ChannelInfo& a, const ChannelInfo& b) { return a.channel < b.channel; });
  info_.clock_steps = clock_.steps();
  info_.file = log.file();
  info_.bytes = log.size();
  info_.damage = log.damage();
  return std::move(info_);
}

LogInfo Describe(const std::string& file) {
  LogReader log(file);
  LogSurvey survey;
  for (LogEvent e; log.Next(&e);) survey.Add(e);
  return survey.Take(log);
}

std::string Format(const LogInfo& info) {
  std::string text =
      Head(info) + fmt::format("{:<20} {:<20} {:>8} {:>11} {:>12} {:>18} {:>18} {:>8} {:>9}\n",
                               "channel", "type", "count", "rate", "bytes", "first [s]", "last [s]",
                               "missing", "gap [s]");
  for (const ChannelInfo& c : info.channels)
    if (c.count > 0) text += Line(c);
  for (const std::string& line : info.Losses()) text += line + "\n";
  return text;
}

}  // namespace chase::logs
