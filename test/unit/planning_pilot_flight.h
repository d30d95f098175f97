#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "services/planning/pilot.h"

namespace chase::planning {

inline constexpr double kPeriod = 0.005;

/// A target that walks along x.
inline Forecast Walking(double t) {
  Forecast f;
  f.t = t;
  f.has_target = true;
  f.target = {t, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  f.target.coefficients << 2.5 + 0.8 * t, 0.0, 0.5, 0.8 * 2.5, 0.0, 0.0;
  f.radius = 0.3;
  f.height = 1.0;
  f.velocity_covariance = 0.04 * Eigen::Matrix3d::Identity();
  return f;
}

/// As prediction says that there is nobody.
inline Forecast Nobody(double t) {
  Forecast f;
  f.t = t;
  return f;
}

/// Flies the pilot's plans perfectly.
class Flight {
 public:
  explicit Flight(const PlanningConfig& config) : pilot(config) {}

  void Run(double seconds, bool with_target) {
    for (const double end = t + seconds; t < end; t += kPeriod) {
      if (hears && std::fmod(t, 0.1) < kPeriod) {
        pilot.SetObstacles(t, obstacles);
        if (!unseen.empty()) pilot.SetUnseen(t, unseen);
      }
      if (predicts && std::fmod(t, 0.3) < kPeriod)
        pilot.SetForecast(with_target ? Forecasts() : Nobody(t));
      if (const auto plan = pilot.Update(t, Body())) {
        plans.push_back(*plan);
        waiting = *plan;
      }
      if (waiting && waiting->trajectory.start <= t) Switch();
      if (flown) largest_step = std::max(largest_step, (Body().p - last).norm());
      last = Body().p;
    }
  }

  Forecast Forecasts() const {
    Forecast f = Walking(t);
    if (curves) f.target.coefficients.conservativeResizeLike(Eigen::MatrixXd::Zero(4, 3));
    return f;
  }

  BodyEstimate Body() const {
    if (!flown) return {{0.0, 0.0, 0.1}, {0.0, 0.0, 0.0}, 0.0};
    const world::Trajectory &plan = flown->trajectory, &way = FlownAt(t);
    const double now = std::min(t, way.end());
    const double tau = std::min(1.0, (t - plan.start) / plan.duration);
    return {way.Position(now), way.Velocity(now), YawAt(flown->yaw, tau, plan.duration).yaw};
  }

  /// As control does it: a plan until its stop begins, then that.
  const world::Trajectory& FlownAt(double time) const {
    return flown->stop && time >= flown->stop->start ? *flown->stop : flown->trajectory;
  }

  Pilot pilot;
  double t = 0.0;
  bool hears = true;     // of obstacles
  bool predicts = true;  // prediction is not silent
  bool curves = false;   // forecasts are no lines, though what they say is
  std::vector<world::Obstacle> obstacles, unseen;
  double largest_step = 0.0, largest_kink = 0.0;
  std::vector<PlanResult> plans;
  std::optional<PlanResult> flown, waiting;

 private:
  void Switch() {
    if (flown) {
      const double start = waiting->trajectory.start;
      const world::Trajectory& way = FlownAt(start);
      largest_kink = std::max(
          largest_kink,
          (way.Position(std::min(start, way.end())) - waiting->trajectory.Position(start)).norm());
    }
    flown = waiting;
    waiting.reset();
  }
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
};

}  // namespace chase::planning
