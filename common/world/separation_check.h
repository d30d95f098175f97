#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/body.h"

namespace chase::world {

/// For tau in [from, to] the body stays on one side of a plane and the ball (or the two balls, and
/// so their convex hull) on the other: n' (p - c) >= h(n) + |n| r, h the support of the body with
/// its uncertainty. A certificate of a body is a list of these whose intervals follow each other.
struct Separation {
  double from = 0.0, to = 1.0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  ///< n, frame W, |n|^2 in [1/2, 2]
};

/// A variance along n smaller than the square of this is bounded as if it were that, m: the bound
/// of the square root is a tangent and needs a slope.
constexpr double kLeastDeviation = 1e-7;

/// Do the separations follow each other without a gap and cover [from, to], each an interval of
/// [0,1] with a normal of about unit length?
bool IsWellFormed(const std::vector<Separation>& certificate, double from, double to);

/// What a separation proves about [from, to] beyond the balls' radii: a lower bound of
/// n' (p - c) - h(n) - |n| r, over |n|, m; negative infinity where the input is no input (an
/// interval outside [0,1], a normal of another length, NaN, a degree above 15). `target`: null, or
/// the second ball. In floating point with a bound on all rounding, well below a microsecond.
double ProvenRoom(const Separation& separation, const Ball& drone, const Ball* target,
                  const Body& body);

/// Is it well formed, with a proven room of 0 or more in each separation? True is a proof that the
/// body is kept off over [from, to]; false says that this certificate is none.
bool IsCertificate(const std::vector<Separation>& certificate, double from, double to,
                   const Ball& drone, const Ball* target, const Body& body);

/// The same question in exact integer arithmetic, square roots rounded up: the reference.
bool IsCertificateExact(const std::vector<Separation>& certificate, double from, double to,
                        const Ball& drone, const Ball* target, const Body& body);

}  // namespace chase::world
