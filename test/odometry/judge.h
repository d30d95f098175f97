#pragma once

#include <string>

namespace chase::odometry::trial {

struct JudgeOptions {
  std::string truth, pose;  ///< logs that hold TRUTH and POSE; may be the same
  double from = 0.0;        ///< mission time, s
  double until = 1e9;
  double fault_at = -1.0, fault_length = 0.0;  ///< mission time and s; negative: none
  std::string series;                          ///< CSV of the errors to write; empty: none
};

/// POSE against TRUTH of the same time, as one JSON object in one line.
std::string Judge(const JudgeOptions& options);

}  // namespace chase::odometry::trial
