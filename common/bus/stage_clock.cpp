#include "common/bus/stage_clock.h"

#include <algorithm>
#include <numeric>

namespace chase::bus {

namespace {

StageClock::Summary Summarise(std::vector<float> ms) {
  StageClock::Summary s;
  if (ms.empty()) return s;
  std::sort(ms.begin(), ms.end());
  const std::size_t n = ms.size();
  s.count = static_cast<long>(n);
  s.mean_ms = std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(n);
  s.p50_ms = ms[n / 2];
  s.p99_ms = ms[std::min(n - 1, n * 99 / 100)];
  s.max_ms = ms.back();
  return s;
}

}  // namespace

std::map<std::string, StageClock::Summary> StageClock::Summaries() const {
  std::map<std::string, Summary> all;
  for (const auto& [name, samples] : samples_ms_) all[name] = Summarise(samples);
  return all;
}

}  // namespace chase::bus
