#pragma once

#include <vector>

#include "services/planning/planner.h"

namespace chase::baselines {

/// A plan of one or more polynomials, in order of time.
using Pieces = std::vector<world::Trajectory>;

Pieces PiecesOf(const planning::PlanResult& plan);
/// The plan being flown; empty when there is none.
Pieces RunningOf(const planning::PlanRequest& request);
void SetPieces(const Pieces& pieces, planning::PlanResult* plan);

/// State at time t [s]; after the end at rest where the plan ends, before the start as at it.
world::State StateAt(const Pieces& pieces, double t);
double EndOf(const Pieces& pieces);

/// What is left of a plan from t0 on; empty when less than `least` seconds are left.
Pieces RestOf(const Pieces& pieces, double t0, double least);

}  // namespace chase::baselines
