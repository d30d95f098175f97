#pragma once

#include "services/perception/place/target_fit.h"

namespace chase::perception {

/// The solution of the same problem as FitTarget() by a small Levenberg-Marquardt solver and the
/// normal equations: equal but for rounding and the solvers' tolerances, at a fraction of the time.
/// For weighing many hypotheses; those that count are refined by FitTarget().
FitResult QuickFit(const FitInput& input, const FitConfig& config);

}  // namespace chase::perception
