#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// Of one of plan_t's verdicts.
const char* VerdictName(int verdict);

/// Walks along with time through the plans as they take over.
class FlownPlans {
 public:
  explicit FlownPlans(const FlightRecord& record) : plans_(record.plans) {}

  /// The newest plan that has begun by t [s], null before the first; times must not go back.
  const PlanSample* At(double t) {
    while (next_ < plans_.size() && plans_[next_].t <= t) ++next_;
    return next_ > 0 ? &plans_[next_ - 1] : nullptr;
  }

 private:
  const std::vector<PlanSample>& plans_;
  size_t next_ = 0;
};

/// How what was flown keeps what was certified: certified_clearance_m, certificate_kept_ratio,
/// tube_exceeded_ratio, tracking_error_p99_m and verdict_s.
void AddCertificates(const FlightRecord& record, const std::vector<SampleScore>& scores,
                     Metrics* m);

}  // namespace chase::logs
