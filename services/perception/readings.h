#pragma once

#include <array>
#include <functional>

#include "services/perception/cylinder_fit.h"

namespace chase::perception {

// Ways to read a silhouette: which sides are the target's, and whether it has just turned sharply.

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

inline constexpr double kHiddenBy = 1.0;  ///< px that a side left out lies off the outline at least

/// True when the prediction or the LiDAR tells how far away it is.
bool RangeIsKnown(const FitInput& input);

/// Tells which readings may hold: sides are left out only where the blob is smaller or larger than
/// expected. All may hold while the range is not known.
std::function<bool(const Sides&)> Sensible(const FitInput& input);

/// The same with the prediction of a target that has just braked, turned or been pushed; across the
/// line of sight only unless points tell the range, since the apparent size alone would take every
/// pixel that is hidden for a leap.
FitInput AfterASharpTurn(const FitInput& input);

}  // namespace chase::perception
