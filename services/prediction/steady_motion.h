#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "services/prediction/observation.h"

namespace chase::prediction {

/// How the target is taken to move when nothing is in its way.
struct MotionConfig {
  bool steady = true;
  double turn_sigma = 0.35;
  double straight_share = 0.6;
  double turn_memory = 1.5;
  double slowing_share = 0.035;
  double gaining_share = 0.02;
  double gain_memory = 0.5;
  double change_cost = 1.6;
  double sigma_floor = 0.005;

  template <class V>
  void Visit(V& v) {
    v("steady", steady,
      "candidates deviate from the steady turn; false: the paper's eq. (8) alone");
    v("turn_sigma", turn_sigma,
      "standard deviation of the turn rate of a target that turns, rad/s");
    v("straight_share", straight_share, "how likely a target goes straight, above 0 and below 1");
    v("turn_memory", turn_memory, "a turn fades with this time constant, s");
    v("slowing_share", slowing_share, "how likely a target is slowing down, above 0 to 0.45");
    v("gaining_share", gaining_share, "how likely it is speeding up, above 0 to 0.45");
    v("gain_memory", gain_memory, "speeding up fades with this time constant, s");
    v("change_cost", change_cost,
      "negative log likelihood of an observation from before the motion changed");
    v("sigma_floor", sigma_floor, "least standard deviation of a merged observation, m");
  }
  std::string Problem() const;
};

/// Forecast of a target that drives at constant speed, straight on or at constant turn rate, and
/// did so since an unknown moment: row k belongs to tau^k, tau = (t - now) / horizon, columns x y z
/// in frame W, m.
///
/// The mean over all hypotheses (turn rate on a grid, first observation of the current motion),
/// weighed by their posterior. For a given turn rate w the place in the plane is linear in place
/// and velocity at `now`, x(t) = x0 + v0 (e^{iwt} - 1) / (iw) as complex numbers, so each has a
/// closed form; observations from before the change cost `change_cost` each. Ahead, the turn
/// rate fades. z goes on in a straight line.
///
/// `observations` sorted by time, all at <= now, at least one; `rows` >= 2; speeds near or above
/// `speed_scale` [m/s] are held for unlikely.
Eigen::Matrix<double, Eigen::Dynamic, 3> SteadyForecast(
    const MotionConfig& config, const std::vector<Observation>& observations, double now,
    double horizon, int rows, double speed_scale);

}  // namespace chase::prediction
