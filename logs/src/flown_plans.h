#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// Of one of plan_t's verdicts.
const char* VerdictName(int verdict);

/// Of that number, the newest that was heard by then; null: none.
const PlanSample* Followed(const FlightRecord& record, const TrackingSample& tracking);

/// Walks along with time through the plans that control followed: TRACKING names them, and each is
/// followed from its start. Of a log whose TRACKING names none, through all plans from their
/// starts until the vehicle comes down.
class FlownPlans {
 public:
  explicit FlownPlans(const FlightRecord& record);

  /// The plan that is flown at t [s], its stop included; null: none; times must not go back.
  const PlanSample* At(double t) {
    while (next_ < steps_.size() && steps_[next_].t <= t) ++next_;
    return next_ > 0 ? steps_[next_ - 1].plan : nullptr;
  }

 private:
  struct Step {
    double t;
    const PlanSample* plan;  // from then on
  };
  std::vector<Step> steps_;
  size_t next_ = 0;
};

/// How what was flown keeps what was certified: certified_clearance_m, certificate_kept_ratio,
/// tube_exceeded_ratio, tracking_error_p99_m and verdict_s.
void AddCertificates(const FlightRecord& record, const std::vector<SampleScore>& scores,
                     Metrics* m);

}  // namespace chase::logs
