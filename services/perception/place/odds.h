#pragma once

#include "services/perception/place/target_fit.h"

namespace chase::perception {

// Logarithms of probability densities of what was measured in one detection.

/// Where sides and points are the target's: the fit's evidence and the measurements' own densities,
/// with sides that are hidden, or run into a like colour, anywhere, and likewise a stray position.
double LogTarget(const FitResult& fit, const FitInput& input, const FitConfig& config);

/// Where they belong to something else of the target's colour.
double LogClutter(const FitInput& input);

/// Taken off for `unexplained` LiDAR points of the detection that lie at other ranges.
double LogUnexplained(double unexplained);

}  // namespace chase::perception
