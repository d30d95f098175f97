#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/logs/log_reader.h"

namespace chase::logs {

/// How long each sweep took to a setpoint of a plan among its obstacles, by what every message says
/// of its own inputs: ATTITUDE_SETPOINT, PLAN, OBSTACLES, SCAN_REGISTERED, LIDAR_SCAN.
class SweepLatency {
 public:
  /// `when` [us] it was heard; never back.
  void Add(int64_t when, const LogEvent& event);
  /// When each answered sweep was heard, and how long after it the first setpoint was that rests on
  /// it or on a newer one; us.
  const std::vector<std::pair<int64_t, int64_t>>& samples() const { return samples_; }

 private:
  std::map<std::string, std::map<int32_t, int64_t>> newest_;  // sweep behind a message, by `seq`
  std::set<int64_t> waiting_;                                 // sweeps that no setpoint rests on
  std::vector<std::pair<int64_t, int64_t>> samples_;
};

}  // namespace chase::logs
