#pragma once

#include <Eigen/Core>

#include "test/baselines/pieces.h"

namespace chase::baselines {

/// Clamped uniform B-spline of degree 5 with 12 control points over [0, duration]. The first four
/// follow from position, velocity, acceleration and jerk at 0; eight are free.
class Spline {
 public:
  static constexpr int kDegree = 5, kControls = 12, kFixed = 4, kFree = kControls - kFixed;
  using Controls = Eigen::Matrix<double, kControls, 3>;
  using Row = Eigen::Matrix<double, 1, kControls>;

  explicit Spline(double duration);

  double duration() const { return duration_; }
  /// Weights of the control points in the derivative of the given order at t [s].
  Row Basis(double t, int order) const;
  /// Integral of products of derivatives of the given order: c' G c is that of the square.
  Eigen::Matrix<double, kControls, kControls> Gram(int order) const;
  /// The first four control points of a spline that begins in `start`.
  Eigen::Matrix<double, kFixed, 3> Fixed(const world::State& start) const;
  /// One polynomial per knot span, from t0 on.
  Pieces ToPieces(const Controls& controls, double t0) const;

 private:
  double Value(int i, int degree, double t) const;

  double duration_;
  Eigen::Matrix<double, 1, kControls + kDegree + 1> knots_;
};

}  // namespace chase::baselines
