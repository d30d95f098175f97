#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// How often nothing better could be planned than a last resort without a proof, and whether
/// braking brakes: plans_in_air, uncertified_brakes and accelerating_brakes.
void AddLastResorts(const FlightRecord& record, Metrics* m);

}  // namespace chase::logs
