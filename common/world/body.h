#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/math/polynomial.h"
#include "common/world/obstacle.h"

namespace chase::world {

/// Power-basis coefficients of a curve in normalised time tau in [0,1]; row k: tau^k, frame W, m.
using Curve = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 16, 3>;

/// A convex solid that moves without turning, and the uncertainty of where it is. What is to be
/// avoided at tau is the Minkowski sum of the solid and the ellipsoid of `sigmas` standard
/// deviations; what else is to be kept off (the drone's radius, tubes, growth) is a ball's radius.
struct Body {
  using Kind = Obstacle::Solid;
  Kind kind = Kind::kEllipsoid;
  bool ground = false;  ///< a box that goes on below: it is left by its top
  Curve center = Curve::Zero(1, 3);
  /// Ellipsoid: Q, m^2, of { x : x' Q^-1 x <= 1 }. Box: columns are its axes. Frame W. The entries
  /// as they are define the solid.
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();
  /// Box: half edges along its axes; cylinder: radius, radius, half height; m.
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  double sigmas = 0.0;
  /// Of the position: coefficients of 1, tau, tau^2, m^2; their sum is positive semidefinite on
  /// [0,1].
  Eigen::Matrix3d covariance[3] = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(),
                                   Eigen::Matrix3d::Zero()};
};

/// A ball about a moving point: the drone with its tube, or the target's end of a line of sight.
struct Ball {
  Curve center = Curve::Zero(1, 3);  ///< frame W, m
  math::Polynomial radius;           ///< power basis in tau, m, >= 0 on [0,1]
};

/// The obstacle over [start, start + duration], its ellipsoid no smaller than the one that R
/// describes, however the inverse of R is rounded; its covariance grows as that of a body at
/// unknown constant velocity since center.start. Of what moves, unless it is known for sure,
/// changes of velocity to come count along the level axes (forecast.h): in full for the first
/// `flown` s, then for less than they may. NaN where R is not positive definite or its inverse is
/// no inverse.
Body MakeBody(const Obstacle& obstacle, double start, double duration, double sigmas,
              double flown = HUGE_VAL);
/// The same over another time, for a body that was made of an obstacle of the same solid, shape and
/// axes, of the ground or not.
void Retime(const Obstacle& obstacle, double start, double duration, double sigmas, double flown,
            Body* body);

/// A point of the solid about the origin, without its uncertainty, where n' x is greatest; n is not
/// zero.
Eigen::Vector3d SupportPoint(const Body& body, const Eigen::Vector3d& n);

/// Unit vector along which a point at `offset` from the body's centre is to leave it: from the
/// nearest point of the solid; for one inside, normal to the level set that it lies on.
Eigen::Vector3d Outwards(const Body& body, const Eigen::Vector3d& offset);

/// Does a curve that starts near the body, or within it, come no nearer to it for tau in
/// [0, until], but for `slack` m of a unit of tau? Along Outwards() at its start it never goes
/// back, so that the plane between them moves away from the body with it.
bool Leaves(const Curve& curve, const Body& body, double until, double slack = 0.0);

/// Standard deviation of the body's position along n at tau, times |n|, m.
double Deviation(const Body& body, const Eigen::Vector3d& n, double tau);

/// (1 + s) Q + (1 + 1/s) r^2 I encloses { x' Q^-1 x <= 1 } and all balls of radius r > 0 about its
/// points, for any s > 0; this s gives its horizontal projection the least area. Kurzhanski and
/// Valyi 1997, "Ellipsoidal Calculus".
Eigen::Matrix3d EnclosingEllipsoid(const Eigen::Matrix3d& Q, double r);

}  // namespace chase::world
