#pragma once

#include <string>

#include "services/planning/problem.h"

namespace chase::planning {

/// How feasibility is decided.
enum class Arithmetic {
  kCertified,    ///< floating point with a proven margin, exact for what that leaves open
  kExactSturm,   ///< Sturm's theorem in exact arithmetic for everything
  kDoubleSturm,  ///< Sturm's theorem in double: fast to write, not a proof
};

/// Is the drone outside the ellipsoid's safety shape, d_p > 1, on [safety_from, 1]?
bool IsSafe(const Curve& plan, const Ellipsoid& e, Arithmetic arithmetic);

/// Does the segment from drone to target miss the ellipsoid's sight shape on [from, 1]? `exact`:
/// P, Q > 0 and (S > 0 or P Q > S^2), with P = d_p - 1 and so on; else the paper's sufficient
/// condition P, Q, S > 0 (proposition 2). Sturm in double knows the latter only.
bool IsInSight(const Curve& plan, const Curve& target, const Ellipsoid& e, double from, bool exact,
               Arithmetic arithmetic);

/// Limits, and safety and sight of every obstacle, sight from `sight_from` on (or the obstacle's
/// own, where later).
bool IsFeasible(const Curve& plan, const Problem& problem, double sight_from, bool exact,
                Arithmetic arithmetic);

/// Dense sampling of d(t) > 1 and of the limits, independent of the certificate: `n` instants.
/// Empty when nothing is broken, else what and where.
std::string SampleFaults(const Curve& plan, const Problem& problem, double sight_from, int n);

}  // namespace chase::planning
