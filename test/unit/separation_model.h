#pragma once

#include "test/unit/separation_pairs.h"

namespace chase::world {

/// Distances by nearest points, without any support function: how the proofs are judged.

/// The point of the solid about the origin that is nearest to x.
Eigen::Vector3d NearestPoint(const Body& body, const Eigen::Vector3d& x);

/// At tau: the least distance of the body, with its uncertainty, from the line of sight (or the
/// drone alone), less the radius of the ball there, m. Below 0 the balls and the body overlap; how
/// deep is not said beyond the radius and an isotropic uncertainty.
double GapAt(const SeparationPair& pair, double tau);

/// The least over tau in [0,1], or the first below -1e-6 that is met.
double LeastGap(const SeparationPair& pair);

}  // namespace chase::world
