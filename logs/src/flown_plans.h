#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// How what was flown keeps what was certified: certified_clearance_m, certificate_kept_ratio,
/// tube_exceeded_ratio, tracking_error_p99_m and verdict_s.
void AddCertificates(const FlightRecord& record, const std::vector<SampleScore>& scores,
                     Metrics* m);

}  // namespace chase::logs
