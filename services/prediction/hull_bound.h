#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "services/prediction/candidate_set.h"

namespace chase::prediction {

/// A point of the sum of hulls: weights per step and point, zero where a point is not allowed.
struct HullPoint {
  std::vector<uint32_t> allowed;  ///< bit i of entry n: point i of step n
  Eigen::MatrixXd weights;        ///< samples x steps, columns sum to 1
  Eigen::VectorXd delta;          ///< sum of the weighted contributions
};

/// All points allowed, equal weights.
HullPoint WholeHull(const CandidateSet& candidates);

/// Forbids a point of a step; its weight goes to the heaviest that is left. False when none is.
bool Forbid(const CandidateSet& candidates, int step, int point, HullPoint* hull);

/// Leaves only one point of a step.
void Fix(const CandidateSet& candidates, int step, int point, HullPoint* hull);

/// Lower bound of the cost over all arrangements allowed by `hull`, and by how much the bound rises
/// where a point is chosen (reduced cost, samples x steps). Moves the point towards the least cost
/// in up to `rounds` passes and stops as soon as the bound reaches `enough`.
double HullLowerBound(const CandidateSet& candidates, int rounds, double enough, HullPoint* hull,
                      Eigen::MatrixXd* reduced);

}  // namespace chase::prediction
