#include "common/bus/stage_clock.h"

#include <algorithm>
#include <cmath>

namespace chase::bus {

void StageClock::Histogram::Add(double ms) {
  if (!std::isfinite(ms)) return;
  const double bin = kBinsPerOctave * std::log2(std::max(ms, kLeastMs) / kLeastMs);
  ++counts_[static_cast<size_t>(std::min(bin, static_cast<double>(counts_.size() - 1)))];
  ++count_;
  sum_ms_ += ms;
  max_ms_ = std::max(max_ms_, ms);
}

// The middle of the bin that the sample of that rank fell into.
double StageClock::Histogram::Percentile(double share) const {
  const long rank = std::min(count_ - 1, static_cast<long>(share * static_cast<double>(count_)));
  size_t bin = 0;
  for (int64_t passed = counts_[0]; passed <= rank; passed += counts_[bin]) ++bin;
  return std::min(max_ms_, kLeastMs * std::exp2((static_cast<double>(bin) + 0.5) / kBinsPerOctave));
}

StageClock::Summary StageClock::Histogram::Summarise() const {
  if (count_ == 0) return {};
  return {count_, sum_ms_ / static_cast<double>(count_), Percentile(0.5), Percentile(0.99),
          max_ms_};
}

std::map<std::string, StageClock::Summary> StageClock::Summaries() const {
  std::map<std::string, Summary> all;
  for (const auto& [name, histogram] : stages_) all[name] = histogram.Summarise();
  return all;
}

}  // namespace chase::bus
