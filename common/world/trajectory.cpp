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
  Trajectory result{new_start, new_duration, {}};
  SetCurve(*this, new_start, new_duration, &result.coefficients);
  return result;
}

Trajectory Trajectory::Constant(const Eigen::Vector3d& p, double start, double duration) {
  Trajectory result{start, duration, Eigen::MatrixXd::Zero(1, 3)};
  result.coefficients.row(0) = p.transpose();
  return result;
}

}  // namespace chase::world
