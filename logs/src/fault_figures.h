#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// How the flight took each fault: faults, fault, fault_time_s, reaction_s and recovery_s.
///
/// An input is overdue from when the newest message of it that was heard is older than
/// world::kMostAge says until the next one comes; a PLAN from when its stop begins. That
/// is the fault's doing when the input ran out during the fault: from its beginning on, with
/// nothing heard since it ended. The reaction comes with the first output that differs in kind, or
/// is none that does at once: OBSTACLES: a plan to brake or to wait, or a stop that control flies;
/// PREDICTION: a plan that is no CHASE, WIDER or KEPT, or a stop;
/// POSE and PLAN: such a stop; TARGET: another state than CHASE; FLIGHT_STATE: a plan to brake or
/// to wait, or a stop. Where there is none until the input is there again, it is as late as that.
///
/// Recovered is the flight with the first plan of CHASE, WIDER or KEPT that is certified and that
/// control says to follow after the fault's end, or at rest on the ground.
void AddFaults(const FlightRecord& record, Metrics* metrics);

}  // namespace chase::logs
