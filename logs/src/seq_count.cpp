#include "logs/src/seq_count.h"

#include <algorithm>

namespace chase::logs {

void SeqCount::Add(int32_t seq) {
  if (!any_) {
    any_ = true;
    first_ = last_ = seq;
    return;
  }
  if (seq >= first_ && seq <= last_) return Fill(seq);
  const bool after = seq > last_;
  const int64_t from = after ? int64_t{last_} + 1 : int64_t{seq} + 1;
  const int64_t to = after ? int64_t{seq} - 1 : int64_t{first_} - 1;
  if (from <= to) {
    gaps_[static_cast<int32_t>(from)] = static_cast<int32_t>(to);
    missing_ += to - from + 1;
  }
  first_ = std::min(first_, seq);
  last_ = std::max(last_, seq);
}

/// A late message takes its place in the gap that it left.
void SeqCount::Fill(int32_t seq) {
  auto gap = gaps_.upper_bound(seq);
  if (gap == gaps_.begin() || (--gap)->second < seq) return;
  const auto [from, to] = *gap;
  gaps_.erase(gap);
  if (from < seq) gaps_[from] = seq - 1;
  if (seq < to) gaps_[seq + 1] = to;
  --missing_;
}

}  // namespace chase::logs
