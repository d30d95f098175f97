#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::mapping {

/// For each row the column that it is assigned to, or -1: the assignment of least total cost, where
/// leaving a row unassigned costs `unassigned` (pairs that cost more are never made). Kuhn-Munkres
/// with potentials, O(n^3).
std::vector<int> Assign(const Eigen::MatrixXd& cost, double unassigned);

}  // namespace chase::mapping
