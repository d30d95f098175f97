#pragma once

#include <vector>

#include "common/world/separation_check.h"

namespace chase::world {

enum class Kept {
  kOff,        ///< proven: `certificate` holds
  kTouches,    ///< at `tau` a point of the segment is nearer than the radius, to a nanometre
  kUndecided,  ///< neither, in an interval of 2^-14 that holds `tau`
};

struct SeparationResult {
  Kept kept = Kept::kUndecided;
  std::vector<Separation> certificate;  ///< in order, covers [from, to]; only with kOff
  double room = 0.0;                    ///< least that it proves beyond the radii, m
  double tau = 0.0;
};

/// Planes that keep the body away from the drone's ball, or from the hull of the drone's and the
/// target's ball where there is a `target`, for tau in [from, to] (all of it in [0,1]). The plane
/// across the line between their means is tried first. An interval gets the plane between the body
/// and the nearest point of the hull of all control points there, and is halved where there is
/// none. What is returned as kOff has passed IsCertificate.
SeparationResult Separate(const Ball& drone, const Ball* target, const Body& body,
                          double from = 0.0, double to = 1.0);

}  // namespace chase::world
