#include "logs/src/fits.h"

namespace chase::logs {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

// Known beforehand, standard deviations.
constexpr double kGain = 10.0;      // 1/s: twice what PX4 has
constexpr double kShare = 1.0;      // of rates fed forward: none or all
constexpr double kGyroBias = 0.05;  // rad/s: 3 degrees/s

/// Error of attitude about x and y of B, rad, and the rates fed forward, turned into it, rad/s.
Eigen::Vector4d Wanted(const Motion& m, const Asked& a) {
  Eigen::Quaterniond error = m.R_WB.conjugate() * a.R_WB;
  if (error.w() < 0.0) error.coeffs() *= -1.0;
  const Vector3d rate = error * a.w_WB_B;
  return {2.0 * error.x(), 2.0 * error.y(), rate.x(), rate.y()};
}

Regression Rates(const SettledFlight& flight, const Lags& lags) {
  const auto wanted = flight.Through<4>(lags, Wanted);
  Regression r = flight.Empty(2, {kGain, kShare, kGyroBias, kGyroBias});
  for (Index k = 0; k < flight.size(); ++k)
    for (int axis = 0; axis < 2; ++axis) {
      const Index row = 2 * k + axis;
      r.y[row] = flight.at(k).w_WB_B[axis];
      r.X(row, 0) = wanted[static_cast<size_t>(k)][axis];
      r.X(row, 1) = wanted[static_cast<size_t>(k)][2 + axis];
      r.X(row, 2 + axis) = 1.0;
    }
  return r;
}

}  // namespace

void FindAttitude(const SettledFlight& flight, Identification* result) {
  const LaggedSolution found = SolveLagged([&](const Lags& lags) { return Rates(flight, lags); });
  const Solution& s = found.solution;
  const double gain = s.value[0], share = s.value[1], delay = s.value[5];
  if (!found.converged || !(gain > 0.0)) return;
  result->attitude_gain = At(s, 0);
  result->rate_share = At(s, 1);
  result->rate_lag = WithSystematic(LagAndDelay(s), flight.hold());
  // (share s + gain) / (lag s^2 + s + gain) lags by (1 - share) / gain where s is small.
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(s.value.size());
  slopes[0] = -(1.0 - share) / (gain * gain);
  slopes[1] = -1.0 / gain;
  slopes[5] = 1.0;
  result->lead = WithSystematic(Derived(s, delay + (1.0 - share) / gain, slopes), flight.hold());
}

}  // namespace chase::logs
