#include <algorithm>

#include "logs/src/fits.h"
#include "services/control/tracking_law.h"

namespace chase::logs {
namespace {

using control::kGravity;
using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGustMemory = 0.1;  // s: gusts beneath white noise
constexpr int kRounds = 2;           // of thrust and vertical drag, each by the other
// Known beforehand, standard deviations.
constexpr double kDrag = 5.0;      // 1/s, control's bound
constexpr double kConstant = 3.0;  // m/s^2: wind of 10 m/s at 0.3 1/s
constexpr double kGain = 1.0;      // of given over asked for

/// Velocities through the air along z of B: a body that leans into the wind feels it from below.
VectorXd Climbs(const SettledFlight& flight, const Vector3d& wind) {
  VectorXd climbs(flight.size());
  for (Index k = 0; k < flight.size(); ++k)
    climbs[k] = (flight.at(k).R_WB.conjugate() * (flight.at(k).v_WB - wind)).z();
  return climbs;
}

/// given = u (gain + bend (u / mean - 1)), with u what is asked for through the lags.
Regression AlongThrust(const SettledFlight& flight, const Lags& lags, double mean,
                       const VectorXd& drag) {
  const auto asked = flight.Through<1>(
      lags, [](const Motion&, const Asked& a) { return Eigen::Matrix<double, 1, 1>(a.thrust); });
  Regression r = flight.Empty(1, {kGain, kGain, kAccelBias});
  r.memory = static_cast<int>(std::lround(kGustMemory / flight.period()));
  for (Index k = 0; k < flight.size(); ++k) {
    const double u = asked[static_cast<size_t>(k)][0];
    r.y[k] = flight.at(k).accel.z() + drag[k];
    r.X.row(k) << u, u * (u / mean - 1.0), 1.0;
  }
  return r;
}

/// Vertical drag from what the thrust leaves: not whitened, since the velocity's error would
/// hide it, while the thrust has to be, since it answers to gusts.
Parameter VerticalDrag(const SettledFlight& flight, const Regression& all, const VectorXd& climbs,
                       const LaggedSolution& thrust) {
  Regression r = flight.Empty(1, {kDrag, kConstant});
  r.X << -climbs, VectorXd::Ones(r.y.size());
  r.y = all.y - all.X.leftCols<2>() * thrust.solution.value.head<2>();
  flight.AddWander(&r);
  Parameter drag = At(Solve(r), 0);
  flight.AddVelocityDoubt(2, &drag);
  Eigen::MatrixXd information = r.X.transpose() * r.X;
  information.diagonal().array() += 1e-9 * static_cast<double>(r.X.rows());
  const VectorXd from_thrust = information.ldlt().solve(r.X.transpose() * thrust.slopes).row(0);
  const double known = from_thrust.dot(thrust.solution.covariance * from_thrust);
  drag.sigma = std::hypot(drag.sigma, std::sqrt(known));
  return drag;
}

/// Hover, where given is gravity: bend / mean u^2 + (gain - bend) u = gravity.
void FindHover(const Solution& s, double mean, double climb, Identification* result) {
  const double bend = s.value[1], linear = s.value[0] - bend;
  const double slope = std::sqrt(linear * linear + 4.0 * bend / mean * kGravity);  // of given
  if (!(slope > 0.0) || !(slope + linear > 0.0)) return;  // no thrust gives gravity
  const double u = 2.0 * kGravity / (slope + linear);
  const double scale = kGravity / u, curvature = bend * u / mean / scale;
  VectorXd d_scale = VectorXd::Zero(s.value.size());
  d_scale.head<2>() << scale / slope, (u / mean - 1.0) * scale / slope;
  VectorXd d_curvature = -2.0 * curvature / scale * d_scale;
  d_curvature[1] += u / mean / scale;
  result->thrust_scale = Derived(s, scale, d_scale);
  double& sigma = result->thrust_scale.sigma;
  result->thrust_scale.systematic = std::min(sigma, kAccelBias / u);
  sigma = std::hypot(sigma, result->drag_vertical.sigma * climb / u);
  result->hover_thrust = {u, u / scale * sigma, u / scale * result->thrust_scale.systematic};
  result->thrust_curvature = Derived(s, curvature, d_curvature);
}

}  // namespace

void FindThrust(const SettledFlight& flight, const Vector3d& wind, Identification* result) {
  double mean = 0.0;
  for (Index k = 0; k < flight.size(); ++k) mean += flight.AskedAt(flight.at(k).t).thrust;
  mean /= static_cast<double>(flight.size());
  if (!(mean > 0.0)) return;
  const VectorXd climbs = Climbs(flight, wind);
  Parameter drag = result->drag_horizontal;
  if (!std::isfinite(drag.sigma)) drag.value = 0.0;
  LaggedSolution found;
  for (int i = 0; i < kRounds; ++i) {
    found = SolveLagged(
        [&](const Lags& lags) { return AlongThrust(flight, lags, mean, drag.value * climbs); });
    drag = VerticalDrag(flight, AlongThrust(flight, found.at, mean, 0.0 * climbs), climbs, found);
  }
  result->drag_vertical = drag;
  FindHover(found.solution, mean, climbs.mean(), result);
  if (!found.converged) return;  // what stands above leans little on the lags
  result->thrust_lag = WithSystematic(LagAndDelay(found.solution), flight.hold());
}

}  // namespace chase::logs
