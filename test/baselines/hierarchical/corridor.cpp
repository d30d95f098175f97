#include "test/baselines/hierarchical/corridor.h"

#include <cmath>

#include "test/baselines/hierarchical/quadratic_program.h"

namespace chase::baselines {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr int kDegree = 6, kTerms = kDegree + 1;
constexpr int kContinuous = 3;  // orders 0 to 2

double Falling(int k, int order) {
  double f = 1.0;
  for (int i = 0; i < order; ++i) f *= k - i;
  return f;
}

/// Row of d^order/dt^order at tau on a leg of `dt` seconds.
RowVectorXd Basis(double tau, int order, double dt) {
  RowVectorXd row = RowVectorXd::Zero(kTerms);
  for (int k = order; k < kTerms; ++k)
    row[k] = Falling(k, order) * std::pow(tau, k - order) / std::pow(dt, order);
  return row;
}

MatrixXd JerkGram(double dt) {
  MatrixXd gram = MatrixXd::Zero(kTerms, kTerms);
  for (int i = 3; i < kTerms; ++i)
    for (int j = 3; j < kTerms; ++j)
      gram(i, j) = Falling(i, 3) * Falling(j, 3) / (i + j - 5) * std::pow(dt, -5);
  return gram;
}

/// The program of one axis without its numbers: only b, d and g depend on the axis.
QuadraticProgram Skeleton(const HierarchicalParameters& p, int legs, double dt) {
  const int n = legs * kTerms, rows = 2 * legs * p.corridor_points;
  QuadraticProgram qp;
  qp.H = MatrixXd::Zero(n, n);
  qp.A = MatrixXd::Zero(kContinuous * legs, n);
  qp.C = MatrixXd::Zero(rows, n);
  const RowVectorXd end = Basis(1.0, 0, dt);
  for (int leg = 0, row = 0; leg < legs; ++leg) {
    qp.H.block(leg * kTerms, leg * kTerms, kTerms, kTerms) =
        2.0 * JerkGram(dt) + 2.0 * p.weight_waypoint * end.transpose() * end;
    for (int order = 0; order < kContinuous; ++order) {
      const int at = kContinuous * leg + order;
      qp.A.block(at, leg * kTerms, 1, kTerms) = Basis(0.0, order, dt);
      if (leg > 0) qp.A.block(at, (leg - 1) * kTerms, 1, kTerms) = -Basis(1.0, order, dt);
    }
    for (int i = 1; i <= p.corridor_points; ++i, row += 2) {
      qp.C.block(row, leg * kTerms, 1, kTerms) = Basis(i / (p.corridor_points + 1.0), 0, dt);
      qp.C.row(row + 1) = -qp.C.row(row);
    }
  }
  return qp;
}

void SetAxis(const HierarchicalParameters& p, const world::State& start,
             const std::vector<Eigen::Vector3d>& waypoints, int axis, double dt,
             QuadraticProgram* qp) {
  const int legs = static_cast<int>(waypoints.size()) - 1;
  const RowVectorXd end = Basis(1.0, 0, dt);
  qp->g = VectorXd::Zero(legs * kTerms);
  qp->b = VectorXd::Zero(kContinuous * legs);
  qp->b.head(kContinuous) << start.p[axis], start.v[axis], start.a[axis];
  qp->d.resize(2 * legs * p.corridor_points);
  for (int leg = 0, row = 0; leg < legs; ++leg) {
    const double from = waypoints[static_cast<size_t>(leg)][axis];
    const double to = waypoints[static_cast<size_t>(leg) + 1][axis];
    qp->g.segment(leg * kTerms, kTerms) = -2.0 * p.weight_waypoint * to * end.transpose();
    for (int i = 1; i <= p.corridor_points; ++i, row += 2) {
      const double on_line = from + (to - from) * i / (p.corridor_points + 1.0);
      qp->d[row] = on_line - p.corridor;
      qp->d[row + 1] = -(on_line + p.corridor);
    }
  }
}

}  // namespace

std::optional<Pieces> SmoothCorridor(const HierarchicalParameters& parameters,
                                     const world::State& start,
                                     const std::vector<Eigen::Vector3d>& waypoints, double t0,
                                     double horizon) {
  const int legs = static_cast<int>(waypoints.size()) - 1;
  const double dt = horizon / legs;
  QuadraticProgram qp = Skeleton(parameters, legs, dt);
  Pieces pieces;
  for (int leg = 0; leg < legs; ++leg)
    pieces.push_back({t0 + leg * dt, dt, Eigen::MatrixXd::Zero(kTerms, 3)});
  for (int axis = 0; axis < 3; ++axis) {
    SetAxis(parameters, start, waypoints, axis, dt, &qp);
    const auto x = Solve(qp);
    if (!x) return std::nullopt;
    for (int leg = 0; leg < legs; ++leg)
      pieces[static_cast<size_t>(leg)].coefficients.col(axis) = x->segment(leg * kTerms, kTerms);
  }
  return pieces;
}

}  // namespace chase::baselines
