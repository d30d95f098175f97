#pragma once

#include <cmath>
#include <vector>

#include "logs/src/identification.h"
#include "logs/src/lagged_response.h"

namespace chase::logs {

/// The instants of a flight that lie so long after a gap that no lag remembers it, and regressions
/// over them.
class SettledFlight {
 public:
  /// `flight` has to outlive it.
  explicit SettledFlight(const FlightSamples& flight);

  Eigen::Index size() const { return static_cast<Eigen::Index>(settled_.size()); }
  const Motion& at(Eigen::Index k) const {
    return flight_.motions[settled_[static_cast<size_t>(k)]];
  }
  /// Whether there are 5 s of it, and setpoints.
  bool Suffices() const;
  double seconds() const { return seconds_; }
  double period() const { return period_; }  ///< between samples, median, s
  /// By which setpoints that are held come late, to one standard deviation, s: the time of a sample
  /// in their period is not known.
  double hold() const { return hold_; }
  Eigen::Vector3d Velocity(Eigen::Index k) const;  ///< frame B, m/s
  Eigen::Vector3d Speeds() const;                  ///< root mean squares, frame B, m/s

  /// Adds to the uncertainty of the drag along an axis of B that velocity is off as odometry says
  /// it may be, at worst all the time in proportion.
  void AddVelocityDoubt(int axis, Parameter* drag) const;

  /// What is asked for at t, interpolated.
  Asked AskedAt(double t) const;

  /// What `signal` of motion and setpoint gives through the lags, at the settled instants.
  template <int N, class Signal>
  std::vector<Eigen::Matrix<double, N, 1>> Through(const Lags& lags, const Signal& signal) const {
    std::vector<Eigen::Matrix<double, N, 1>> out;
    out.reserve(settled_.size());
    Eigen::Matrix<double, N, 1> last = Eigen::Matrix<double, N, 1>::Zero(), state = last;
    const Motion* before = nullptr;
    for (size_t i = 0; i < flight_.motions.size(); ++i) {
      const Motion& m = flight_.motions[i];
      const Eigen::Matrix<double, N, 1> now = signal(m, AskedAt(m.t - lags.delay));
      if (!before || before->stretch != m.stretch)
        state = now;
      else
        state += (1.0 - std::exp((before->t - m.t) / lags.lag)) * (0.5 * (last + now) - state);
      if (out.size() < settled_.size() && settled_[out.size()] == i) out.push_back(state);
      last = now;
      before = &m;
    }
    return out;
  }

  /// Of `rows` rows for each instant, all zero.
  Regression Empty(int rows, const std::vector<double>& prior) const;
  /// Lets the bias of each axis wander: a constant more for every ten seconds. A single climb shows
  /// nothing else from it.
  void AddWander(Regression* r) const;

 private:
  const FlightSamples& flight_;
  std::vector<size_t> settled_;
  double seconds_ = 0.0, period_ = 0.0, hold_ = 0.0;
};

}  // namespace chase::logs
