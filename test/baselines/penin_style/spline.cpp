#include "test/baselines/penin_style/spline.h"

#include <Eigen/LU>
#include <cmath>

namespace chase::baselines {
namespace {

constexpr int kSpans = Spline::kControls - Spline::kDegree;

}  // namespace

Spline::Spline(double duration) : duration_(duration) {
  for (int i = 0; i < knots_.size(); ++i) {
    const int inner = std::min(std::max(0, i - kDegree), kSpans);
    knots_[i] = duration * inner / kSpans;
  }
}

// Cox and de Boor; the last span includes its end.
double Spline::Value(int i, int degree, double t) const {
  if (degree == 0) {
    const bool last = knots_[i + 1] >= duration_ && t >= duration_;
    return (t >= knots_[i] && (t < knots_[i + 1] || (last && knots_[i] < knots_[i + 1]))) ? 1.0
                                                                                          : 0.0;
  }
  double sum = 0.0;
  const double left = knots_[i + degree] - knots_[i];
  const double right = knots_[i + degree + 1] - knots_[i + 1];
  if (left > 0.0) sum += (t - knots_[i]) / left * Value(i, degree - 1, t);
  if (right > 0.0) sum += (knots_[i + degree + 1] - t) / right * Value(i + 1, degree - 1, t);
  return sum;
}

// Derivatives: differences of control points over knot differences, a matrix per order.
Spline::Row Spline::Basis(double t, int order) const {
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(kControls, kControls);
  for (int k = 0; k < order; ++k) {
    const int degree = kDegree - k;
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(map.rows() - 1, kControls);
    for (int i = 0; i < next.rows(); ++i)
      next.row(i) =
          degree / (knots_[i + k + 1 + degree] - knots_[i + k + 1]) * (map.row(i + 1) - map.row(i));
    map = next;
  }
  Row row = Row::Zero();
  for (int i = 0; i < map.rows(); ++i) row += Value(i + order, kDegree - order, t) * map.row(i);
  return row;
}

Eigen::Matrix<double, Spline::kControls, Spline::kControls> Spline::Gram(int order) const {
  // Gauss-Legendre with four points is exact up to degree 7; squares here have at most 6 (order 2).
  constexpr double kNode[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                              0.8611363115940526};
  constexpr double kWeight[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461,
                                0.3478548451374538};
  Eigen::Matrix<double, kControls, kControls> gram;
  gram.setZero();
  const double half = 0.5 * duration_ / kSpans;
  for (int span = 0; span < kSpans; ++span)
    for (int k = 0; k < 4; ++k) {
      const Row row = Basis(half * (2 * span + 1 + kNode[k]), order);
      gram += half * kWeight[k] * row.transpose() * row;
    }
  return gram;
}

Eigen::Matrix<double, Spline::kFixed, 3> Spline::Fixed(const world::State& start) const {
  Eigen::Matrix4d A;
  Eigen::Matrix<double, kFixed, 3> rhs;
  const Eigen::Vector3d value[] = {start.p, start.v, start.a, start.j};
  for (int order = 0; order < kFixed; ++order) {
    A.row(order) = Basis(0.0, order).head<kFixed>();
    rhs.row(order) = value[order].transpose();
  }
  return A.partialPivLu().solve(rhs);
}

// Taylor's series at the start of each span is the polynomial.
Pieces Spline::ToPieces(const Controls& controls, double t0) const {
  Pieces pieces;
  const double step = duration_ / kSpans;
  for (int span = 0; span < kSpans; ++span) {
    world::Trajectory piece{t0 + span * step, step, Eigen::MatrixXd::Zero(kDegree + 1, 3)};
    double scale = 1.0;
    for (int k = 0; k <= kDegree; ++k) {
      piece.coefficients.row(k) = scale * Basis(span * step, k) * controls;
      scale *= step / (k + 1);
    }
    pieces.push_back(piece);
  }
  return pieces;
}

}  // namespace chase::baselines
