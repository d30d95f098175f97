#pragma once

#include <cstdint>
#include <map>

namespace chase::logs {

/// Counts what is missing from a sender's numbered messages. Late ones and repeated ones count
/// once.
class SeqCount {
 public:
  void Add(int32_t seq);
  /// Messages between the lowest and the highest number that never came.
  int64_t missing() const { return missing_; }
  int32_t first() const { return first_; }
  int32_t last() const { return last_; }

 private:
  void Fill(int32_t seq);

  bool any_ = false;
  int32_t first_ = 0, last_ = 0;
  int64_t missing_ = 0;
  std::map<int32_t, int32_t> gaps_;  ///< first number that is missing to the last in a row
};

}  // namespace chase::logs
