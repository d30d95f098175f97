#pragma once

#include "services/planning/problem.h"

namespace chase::planning {

enum class Layout { kNormal, kWide, kCautious };

/// View skeletons (Jeon 2021, section IV-A): at the times n T / N, points around the target at
/// radii (1 -+ spread) l_des and low elevations. Azimuths lie densest around the drone's present
/// bearing and reach round the whole ring. kWide doubles the choices and spreads radii and
/// elevations.
///
/// With config.adaptive a point that an obstacle covers, or from which the target is hidden, slides
/// to the nearest azimuth and radius that are free, and clutter around the target adds choices.
void PlaceSkeletons(const PlannerConfig& config, Layout layout, Problem* problem);

/// The same points without regard to obstacles, `choices` at each of `steps` times.
void PlaceRing(const PlannerConfig& config, int steps, int choices, Problem* problem);

}  // namespace chase::planning
