#pragma once

#include <array>
#include <vector>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

// Ways to read a silhouette: which sides are the target's.

using Sides = std::array<bool, 4>;  ///< by Side: seen

/// From all sides seen to all but the bottom hidden or run into a like colour.
inline constexpr std::array<Sides, 12> kReadings = {{{true, true, true, true},
                                                     {false, true, true, true},
                                                     {true, false, true, true},
                                                     {true, true, false, true},
                                                     {true, true, true, false},
                                                     {false, true, false, true},
                                                     {false, true, true, false},
                                                     {true, false, false, true},
                                                     {true, false, true, false},
                                                     {true, true, false, false},
                                                     {false, false, true, true},
                                                     {false, false, false, true}}};
inline constexpr size_t kOneHidden = 5;  ///< of them, with at most one side left out

/// True when the prediction or the LiDAR tells how far away it is.
bool RangeIsKnown(const FitInput& input);

/// A target of which nothing is known but its range [m] and that it shows in this box.
TargetGaussian NewTarget(const Camera& camera, const cv::Rect2d& box, const TargetShape& shape,
                         double range, double range_sigma);

// Logarithms of probability densities of what was measured in one detection.

/// Where sides and points are the target's: the fit's evidence and the measurements' own densities,
/// with sides that are hidden, or run into a like colour, anywhere, and likewise a stray position.
double LogTarget(const FitResult& fit, const FitInput& input, const FitConfig& config);

/// Added where `target` stands: for LiDAR rays (`input.hits`) that see what lies behind it.
double LogSeenThrough(const FitInput& input, const TargetGaussian& target);

/// Where they belong to something else of the target's colour.
double LogClutter(const FitInput& input);

}  // namespace chase::perception
