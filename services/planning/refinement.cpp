#include "services/planning/refinement.h"

#include "services/planning/certificate.h"
#include "services/planning/cost.h"

namespace chase::planning {
namespace {

constexpr int kRounds = 3;
constexpr double kStep = 0.1;  // m, of the position at the end of the horizon

// Power coefficients of the last two Bernstein polynomials of degree n: tau^(n-1) (1 - tau) n,
// tau^n.
void MoveFree(Curve* plan, int which, const Eigen::RowVector3d& step) {
  const Eigen::Index n = plan->rows() - 1;
  if (which == 0) {
    plan->row(n) += step;
  } else {
    plan->row(n - 1) += static_cast<double>(n) * step;
    plan->row(n) -= static_cast<double>(n) * step;
  }
}

}  // namespace

bool Refine(const PlannerConfig& config, const Problem& problem, double sight_from, Curve* plan,
            Cost* cost) {
  bool changed = false;
  double size = kStep;
  for (int round = 0; round < kRounds; ++round, size *= 0.5)
    for (int which = 0; which < 2; ++which)
      for (int axis = 0; axis < 3; ++axis) {
        for (double sign : {1.0, -1.0}) {
          Curve moved = *plan;
          MoveFree(&moved, which, sign * size * Eigen::RowVector3d::Unit(axis));
          const Cost moved_cost = Evaluate(config, problem, moved);
          if (!(moved_cost.total < cost->total) ||
              !IsFeasible(moved, problem, sight_from, config.exact_visibility,
                          Arithmetic::kCertified))
            continue;
          *plan = moved;
          *cost = moved_cost;
          changed = true;
          break;
        }
      }
  return changed;
}

}  // namespace chase::planning
