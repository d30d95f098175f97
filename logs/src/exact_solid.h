#pragma once

#include "chase/obstacle_t.hpp"
#include "chase/prediction_t.hpp"
#include "logs/src/rational.h"

namespace chase::logs::exact {

/// A solid about a moving centre over the time of a way, and the covariances of that centre.
struct Solid {
  int8_t kind = obstacle_t::CYLINDER;
  bool ground = false;  ///< a box that goes on below
  Matrix shape{};       ///< ellipsoid: R
  Matrix inverse{};     ///< ellipsoid: of R
  Matrix axes{};        ///< box: rows are its axes
  Vector half{};
  Curve center;  ///< by the way's tau
  Matrix covariance{}, velocity_covariance{};
  Rational age, ageing;  ///< of the covariances at tau, s: age + ageing tau

  /// At least max n' x over the solid about the origin.
  Rational Support(const Vector& n) const;
  /// The normal at the nearest point of the solid, from inside that of the level set through the
  /// offset; of the ground its top's.
  Vector Outwards(const Vector& offset) const;
};

/// Changes of a mover's velocity count in full for the first `flown` s of the way.
Solid SolidOf(const obstacle_t& m, const polynomial_t& way, double flown);
/// The target's own body, an upright cylinder.
Solid SolidOf(const prediction_t& m, const polynomial_t& way);

}  // namespace chase::logs::exact
