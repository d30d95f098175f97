#include "services/planning/product_weights.h"

#include "common/math/polynomial.h"

namespace chase::planning {
namespace {

WeightTable MakeWeights(int n) {
  WeightTable w{};
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      w.value[i][j] = math::Binomial(n, i) * math::Binomial(n, j) / math::Binomial(2 * n, i + j);
  return w;
}

}  // namespace

const WeightTable& ProductWeights(int degree) {
  static const WeightTable quintic = MakeWeights(5), sextic = MakeWeights(6);
  return degree == 5 ? quintic : sextic;
}

}  // namespace chase::planning
