#include "services/prediction/reference.h"

#include <algorithm>
#include <utility>

#include "common/math/exact.h"

namespace chase::prediction {
namespace {

Choice Arrangement(const CandidateSet& candidates, int64_t number) {
  Choice choice;
  for (int n = 0; n < candidates.steps(); ++n, number /= candidates.samples())
    choice.push_back(static_cast<int>(number % candidates.samples()));
  return choice;
}

math::ExactPolynomial ExactColumn(const Coefficients& c, int axis) {
  return math::MakeExact(math::Polynomial(c.col(axis)));
}

bool IsClearBySturm(const Coefficients& q, const HorizonObstacle& obstacle) {
  math::ExactPolynomial excess = math::MakeExact(-1.0);  // d_q - 1
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      excess = excess + math::MakeExact(obstacle.shape(a, b)) *
                            (ExactColumn(q, a) - ExactColumn(obstacle.center, a)) *
                            (ExactColumn(q, b) - ExactColumn(obstacle.center, b));
  return math::SignAtZero(excess) > 0 && math::CountRootsExact(excess) == 0;
}

bool IsClearOfAll(const Coefficients& q, const std::vector<HorizonObstacle>& obstacles) {
  // A place well inside settles it; this saves the exact arithmetic in most collisions.
  for (const HorizonObstacle& o : obstacles)
    if (NearestApproach(q, o, 20).distance < 1.0 - 1e-6) return false;
  return std::all_of(obstacles.begin(), obstacles.end(),
                     [&q](const HorizonObstacle& o) { return IsClearBySturm(q, o); });
}

}  // namespace

SearchResult ReferenceSearch(const CandidateSet& candidates,
                             const std::vector<HorizonObstacle>& obstacles) {
  std::vector<std::pair<double, int64_t>> order;
  for (int64_t i = 0; i < candidates.count(); ++i)
    order.emplace_back(candidates.Cost(candidates.Delta(Arrangement(candidates, i))), i);
  std::sort(order.begin(), order.end());
  SearchResult result;
  for (const auto& [cost, number] : order) {
    const Choice choice = Arrangement(candidates, number);
    const Coefficients q = candidates.CoefficientsOf(candidates.Delta(choice));
    ++result.checked;
    if (!IsClearOfAll(q, obstacles)) continue;
    result.choice = choice;
    result.cost = cost;
    break;
  }
  result.nodes = candidates.count();
  result.lower_bound = result.cost;
  return result;
}

}  // namespace chase::prediction
