#include <algorithm>

#include "logs/src/fits.h"

namespace chase::logs {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kInstant = 0.1;  // s: a sweep, in which odometry corrects its velocity once
constexpr int kMemory = 5;        // instants
// Known beforehand, standard deviations.
constexpr double kDrag = 5.0;  // 1/s, control's bound
constexpr double kWind = 3.0;  // m/s^2: 10 m/s at 0.3 1/s

/// Means over `width` instants.
Regression Averaged(const Regression& r, Index width) {
  Regression means = r;
  const Index n = r.y.size() / (r.rows * width) * r.rows;
  means.X = Eigen::MatrixXd::Zero(n, r.X.cols());
  means.y = Eigen::VectorXd::Zero(n);
  for (Index row = 0; row < n * width; ++row) {
    const Index mean = row / (r.rows * width) * r.rows + row % r.rows;
    means.X.row(mean) += r.X.row(row) / static_cast<double>(width);
    means.y[mean] += r.y[row] / static_cast<double>(width);
  }
  return means;
}

/// Gusts come as an autoregression. Its instants are so long that the noise of a velocity is small
/// beside its change from one to the next.
Regression AcrossThrust(const SettledFlight& flight) {
  Regression r = flight.Empty(2, {kDrag, kDrag, kWind, kWind, kAccelBias, kAccelBias});
  for (Index k = 0; k < flight.size(); ++k) {
    const Vector3d v = flight.Velocity(k);
    const Eigen::Matrix3d R_BW = flight.at(k).R_WB.conjugate().toRotationMatrix();
    for (int axis = 0; axis < 2; ++axis) {
      const Index row = 2 * k + axis;
      r.y[row] = flight.at(k).accel[axis];
      r.X(row, axis) = -v[axis];
      r.X.block<1, 2>(row, 2) = R_BW.block<1, 2>(axis, 0);
      r.X(row, 4 + axis) = 1.0;
    }
  }
  flight.AddWander(&r);
  r.memory = kMemory;
  return Averaged(r, std::max<Index>(1, std::lround(kInstant / flight.period())));
}

/// The mean of both directions with the least variance. Control knows one drag for all headings:
/// where they differ by more than they are uncertain, it is the more uncertain (Birge 1932).
Parameter OfBoth(const Parameter& a, const Parameter& b, double covariance) {
  const double va = a.sigma * a.sigma, vb = b.sigma * b.sigma;
  const double variance = va + vb - 2.0 * covariance;
  if (!std::isfinite(variance) || !(variance > 0.0)) return {};
  const double share = std::clamp((vb - covariance) / variance, 0.0, 1.0), rest = 1.0 - share;
  const double sigma =
      std::sqrt(share * share * va + rest * rest * vb + 2.0 * share * rest * covariance);
  const double ratio = std::max(1.0, std::abs(a.value - b.value) / std::sqrt(variance));
  const double birge = sigma * std::sqrt(ratio * ratio - 1.0);
  return {share * a.value + rest * b.value, ratio * sigma,
          std::hypot(birge, share * a.systematic, rest * b.systematic)};
}

}  // namespace

Vector3d FindDrag(const SettledFlight& flight, Identification* result) {
  const Solution s = Solve(AcrossThrust(flight));
  Parameter* const axes[] = {&result->drag_forward, &result->drag_sideways};
  for (int axis = 0; axis < 2; ++axis) {
    *axes[axis] = At(s, axis);
    flight.AddVelocityDoubt(axis, axes[axis]);
  }
  const Parameter drag = result->drag_horizontal =
      OfBoth(result->drag_forward, result->drag_sideways, s.covariance(0, 1));
  if (!std::isfinite(drag.sigma)) return Vector3d::Zero();
  const double share = drag.value / (drag.value * drag.value + drag.sigma * drag.sigma);
  return share * Vector3d(s.value[2], s.value[3], 0.0);
}

}  // namespace chase::logs
