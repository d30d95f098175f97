#include "services/viewer/scene.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/world/forecast.h"

namespace chase::viewer {

Axes AxesOf(const Eigen::Matrix3d& S) {
  Axes axes;
  if (!S.allFinite()) return axes;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(S);
  Eigen::Matrix3d R = solver.eigenvectors();
  if (R.determinant() < 0.0) R.col(0) *= -1.0;
  axes.half = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  axes.R = Eigen::Quaterniond(R);
  return axes;
}

Solid SolidOf(const world::Obstacle& o, double t) {
  using Kind = world::Obstacle::Solid;
  Solid solid{o.center.Position(t), o.center.Velocity(t), o.half, Eigen::Quaterniond::Identity()};
  if (o.solid == Kind::kBox) solid.R = o.axes;
  if (o.solid != Kind::kEllipsoid) return solid;
  const Axes inverse = AxesOf(o.shape);  // half: one over the semi-axes
  for (int i = 0; i < 3; ++i) solid.half[i] = inverse.half[i] > 0.0 ? 1.0 / inverse.half[i] : 0.0;
  solid.R = inverse.R;
  return solid;
}

double SpreadAt(const Forecast& forecast, double dt) {
  return AxesOf(world::ForecastCovariance(forecast.covariance, forecast.velocity_covariance, dt))
      .half.maxCoeff();
}

}  // namespace chase::viewer
