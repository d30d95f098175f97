#include "common/logs/log_clock.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace chase::logs {
namespace {

// Chosen, not measured: more than recorders and schedulers delay by, less than what somebody sets.
constexpr int64_t kGapPeriods = 10;
constexpr size_t kFewest = 20;                                  // of a channel to have a period
constexpr int64_t kStepAhead = 2'000'000, kStepBack = 300'000;  // us, at least, of a clock
constexpr int64_t kMostLate = 2'000'000;                        // us, of a message to be logged
constexpr int kMostUnsure = 50;  // events after a jump until it counts as a pause

}  // namespace

int64_t LogClock::Median(const Channel& channel) {
  if (channel.periods.size() < kFewest) return 0;
  std::vector<int64_t> values = channel.periods;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

int64_t LogClock::Period(const std::string& channel) const {
  const auto found = channels_.find(channel);
  return found == channels_.end() ? 0 : Median(found->second);
}

/// A step it is where a channel goes on with its next number though ten of its periods have passed,
/// or none; a pause of the log where it does not. Rare channels cannot tell, others will.
LogClock::Jump LogClock::JumpOf(int64_t utime, const bus::MessageHead& head,
                                const Channel& channel) const {
  const int64_t by = utime - sure_.value_or(utime), since = utime - channel.previous;
  if (by <= kStepAhead && by >= -kStepBack) return Jump::kNone;
  const auto last = channel.seqs.find({head.sender, head.vehicle, head.sender_start});
  const bool next = last != channel.seqs.end() && head.seq == int64_t{last->second} + 1;
  if (next && since < 0) return Jump::kStep;
  const int64_t period = Median(channel);
  if (last != channel.seqs.end() && period > 0 && std::abs(since) / kGapPeriods >= period)
    return next ? Jump::kStep : Jump::kPause;
  const bool another_can = std::any_of(channels_.begin(), channels_.end(), [&](const auto& c) {
    const int64_t its = Median(c.second);
    return its > 0 && std::abs(by) / kGapPeriods >= its;
  });
  return another_can && unsure_ < kMostUnsure ? Jump::kPerhaps : Jump::kPause;
}

/// Until somebody tells it counts as a step.
int64_t LogClock::Settle(int64_t utime, Jump jump) {
  const bool waits = jump == Jump::kPerhaps, goes_on = waits || jump == Jump::kStep;
  const int64_t by = goes_on ? utime - *sure_ : 0;
  if (jump == Jump::kStep) {
    steps_.push_back({by, *sure_ - first_});
    set_before_ = std::exchange(set_, set_ + by);
  }
  unsure_ = waits ? unsure_ + 1 : 0;
  perhaps_ = waits ? by : 0;
  return *(sure_ = utime - by);
}

int64_t LogClock::Add(const LogEvent& e) {
  const auto [found, fresh] = channels_.try_emplace(e.channel);
  Channel& channel = found->second;
  now_ = e.utime - set_ - perhaps_;
  if (const auto head = bus::HeadOf(e.bytes.data(), e.bytes.size())) {
    now_ = e.utime - set_;
    now_ = Settle(now_, JumpOf(now_, *head, channel));
    const std::tuple sender(head->sender, head->vehicle, head->sender_start);
    int32_t& seq = channel.seqs.try_emplace(sender, head->seq).first->second;
    seq = std::max(seq, head->seq);
  }
  if (!fresh) channel.periods.push_back(now_ - channel.previous);
  channel.previous = now_;
  first_ = std::min(first_, now_);
  return now_;
}

int64_t LogClock::SetBy(int64_t utime) const {
  const auto age = [&](int64_t set) { return std::abs(now_ + set - utime); };
  const bool is_past = steps_.empty() || now_ - first_ - steps_.back().at > kMostLate;
  const int64_t set = set_ + perhaps_, before = perhaps_ || is_past ? set_ : set_before_;
  return age(set) <= age(before) ? set : before;
}

}  // namespace chase::logs
