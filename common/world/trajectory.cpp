#include "common/world/trajectory.h"

#include <cmath>

namespace chase::world {

Eigen::Vector3d Trajectory::Derivative(int order, double t) const {
  const double tau = (t - start) / duration;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = degree(); k >= order; --k) {
    double falling = 1.0;
    for (int i = 0; i < order; ++i) falling *= k - i;
    sum = sum * tau + falling * coefficients.row(k).transpose();
  }
  return sum / std::pow(duration, order);
}

State Trajectory::At(double t) const {
  return {Derivative(0, t), Derivative(1, t), Derivative(2, t), Derivative(3, t)};
}

Trajectory Trajectory::Reparametrised(double new_start, double new_duration) const {
  // tau = a + b sigma: expand sum_k c_k (a + b sigma)^k by Horner's rule on polynomials.
  const double a = (new_start - start) / duration;
  const double b = new_duration / duration;
  Trajectory result{new_start, new_duration, Eigen::MatrixXd::Zero(degree() + 1, 3)};
  auto& r = result.coefficients;
  for (int k = degree(); k >= 0; --k) {
    for (int i = degree(); i > 0; --i) r.row(i) = a * r.row(i) + b * r.row(i - 1);
    r.row(0) = a * r.row(0) + coefficients.row(k);
  }
  return result;
}

Trajectory Trajectory::Constant(const Eigen::Vector3d& p, double start, double duration) {
  Trajectory result{start, duration, Eigen::MatrixXd::Zero(1, 3)};
  result.coefficients.row(0) = p.transpose();
  return result;
}

}  // namespace chase::world
