#include "services/fcu/clock_sync.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace chase::fcu {
namespace {

// Two crystals drift apart by 50 us/s at most: 0.2 ms over the window, of which half shows.
constexpr int64_t kWindow = 4'000'000;
constexpr int64_t kLongestTrip = 1'000'000;
// Farther off than the trip's own duration allows by this much: a clock that jumped (PX4's own
// limit for its side of the same estimate is 100 ms).
constexpr int64_t kJump = 20'000;
constexpr std::size_t kOutliers = 5;  // in a row: it did

}  // namespace

void ClockSync::Add(int64_t sent, int64_t remote, int64_t received) {
  const Trip trip{sent + (received - sent) / 2 - remote, received - sent, received};
  if (trip.duration < 0 || trip.duration > kLongestTrip) return;
  if (synced() && std::llabs(trip.offset - offset_) > kJump + trip.duration / 2) {
    outliers_.push_back(trip);
    if (outliers_.size() < kOutliers) return;
    ++restarts_;
    trips_.swap(outliers_);
  } else {
    trips_.push_back(trip);
  }
  outliers_.clear();
  while (trips_.front().received < received - kWindow) trips_.pop_front();
  Settle();
}

/// The mean of the quickest quarter: one trip alone would hand its own error on.
void ClockSync::Settle() {
  std::vector<Trip> quick(trips_.begin(), trips_.end());
  std::stable_sort(quick.begin(), quick.end(),
                   [](const Trip& a, const Trip& b) { return a.duration < b.duration; });
  const std::size_t n = std::max<std::size_t>(1, quick.size() / 4);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < n; ++i) sum += static_cast<double>(quick[i].offset - quick[0].offset);
  const double mean = sum / static_cast<double>(n);
  offset_ = quick[0].offset + std::llround(mean);
  const std::size_t half = (quick.size() + 1) / 2;
  for (std::size_t i = 0; i < half; ++i)
    squares += std::pow(static_cast<double>(quick[i].offset - offset_), 2);
  jitter_ = 1e-6 * std::sqrt(squares / static_cast<double>(half));
  round_trip_ = 1e-6 * static_cast<double>(quick[0].duration);
}

std::optional<int64_t> ClockSync::HostTime(int64_t remote) const {
  if (!synced()) return std::nullopt;
  return remote + offset_;
}

}  // namespace chase::fcu
