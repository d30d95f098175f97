#pragma once

namespace chase::planning {

/// Weights of products in Bernstein form: coefficient k of a b is the sum over i + j = k of
/// value[i][j] a_i b_j.
struct WeightTable {
  double value[7][7];
};
const WeightTable& ProductWeights(int degree);

}  // namespace chase::planning
