#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/world/body.h"
#include "common/world/certificate.h"

namespace chase::world {

/// A variance along n smaller than the square of this is bounded as if it were that, m: the bound
/// of the square root is a tangent and needs a slope.
constexpr double kLeastDeviation = 1e-7;

/// Do the separations follow each other without a gap and cover [from, to], each an interval of
/// [0,1] with a normal of about unit length?
bool IsWellFormed(const Certificate& certificate, double from, double to);

/// A ball over [from, to] in Bernstein form, to be kept off many bodies.
struct Sweep {
  static constexpr int kTerms = 16;

  /// Of the given degree, or that of the ball where it is higher.
  Sweep(const Ball& ball, double from, double to, int degree);
  void SetRadius(const math::Polynomial& radius);

  double from, to;
  int degree;  ///< below 0: no interval of [0,1], or a degree above 15: nothing is proven
  double points[4][kTerms];  ///< coefficients of x, y, z of the centre and of the radius, m
  double size[4];            ///< of each the sum of the absolute values in the power basis, m
};

/// The least degree at which a ball is asked of a body.
int DegreeOf(const Ball& ball, const Body& body);

/// A ball that is asked of one body after the other: most are asked over one interval at one
/// degree, and its sweep is computed anew only where these change.
class SweptBall {
 public:
  /// Keeps a pointer to the ball.
  explicit SweptBall(const Ball& ball) : ball_(&ball) {}
  /// To be called when the ball's radius has changed.
  void TakeRadius() {
    if (sweep_) sweep_->SetRadius(ball_->radius);
  }
  const Sweep& Over(double from, double to, const Body& body);
  const Ball& ball() const { return *ball_; }

 private:
  const Ball* ball_;
  std::optional<Sweep> sweep_;  ///< the last one
};

/// What a plane proves of each ball, m.
struct Rooms {
  double drone, target;

  double Least() const { return drone < target ? drone : target; }
};

/// What a separation by a plane with this normal proves about the sweeps' interval beyond the
/// balls' radii: a lower bound of n' (p - c) - h(n) - |n| r, over |n|; negative infinity where the
/// input is no input (a sweep that is none, of too low a degree or over another interval than the
/// drone's, a normal of another length, NaN). `target`: null, then its room is infinite, or the
/// second ball. In floating point with a bound on all rounding, in about 0.1 us.
Rooms ProvenRooms(const Eigen::Vector3d& normal, const Sweep& drone, const Sweep* target,
                  const Body& body);

/// Is it well formed, with a proven room of 0 or more in each separation? True is a proof that the
/// body is kept off over [from, to]; false says that this certificate is none.
bool IsCertificate(const Certificate& certificate, double from, double to, SweptBall* drone,
                   SweptBall* target, const Body& body);

/// The same question in exact integer arithmetic, square roots rounded up: the reference.
bool IsCertificateExact(const Certificate& certificate, double from, double to, const Ball& drone,
                        const Ball* target, const Body& body);

}  // namespace chase::world
