#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "services/planning/pilot.h"

namespace chase::planning::test {

using Eigen::Vector3d;

inline constexpr double kPeriod = 0.005;  // s

inline world::Obstacle Pillar(int id, double x, double y) {
  world::Obstacle o;
  o.id = id;
  o.solid = world::Obstacle::Solid::kCylinder;
  o.half = {0.3, 0.3, 2.0};
  o.shape = (2.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 1.0);
  return o;
}

/// Flies the pilot's plans perfectly; control says whether it flies.
class Flight {
 public:
  explicit Flight(const Vector3d& start = {0.0, 0.0, 0.1}) : rest_(start) {}

  void Run(double seconds) {
    for (const double end = t + seconds; t < end; t += kPeriod) {
      pilot.SetFlying(flying_before || flown.has_value());
      if (hears && std::fmod(t, 0.1) < kPeriod) pilot.SetObstacles(t, obstacles);
      if (std::fmod(t, 0.3) < kPeriod && sees_target) pilot.SetForecast(Walking());
      if (const auto plan = pilot.Update(t, Body())) {
        EXPECT_FALSE(plan->yaw.empty()) << plan->reason;
        plans.push_back(*plan);
        waiting_ = plan;
      }
      if (waiting_ && waiting_->trajectory.start <= t) flown = waiting_;
      for (const world::Obstacle& o : obstacles) {
        const Vector3d off = Body().p - o.center.Position(0.0);
        nearest = std::min(nearest, off.head<2>().norm() - o.half.x());
      }
    }
  }
  Forecast Walking() const {
    Forecast f;
    f.t = t;
    f.has_target = true;
    f.target = {t, 2.5, Eigen::MatrixXd::Zero(2, 3)};
    f.target.coefficients << 2.5 + 0.8 * t, 0.0, 0.5, 0.8 * 2.5, 0.0, 0.0;
    return f;
  }
  BodyEstimate Body() const {
    if (!flown) return {rest_, Vector3d::Zero(), 0.0};
    const double now = std::min(t, flown->trajectory.end());
    const bool over = t > flown->trajectory.end();
    return {flown->trajectory.Position(now),
            over ? Vector3d::Zero() : flown->trajectory.Velocity(now), 0.0};
  }
  /// In the air and chasing for so long.
  void Chase(double seconds) {
    pilot.SetTask(Task::kTakeoff, rest_);
    Run(5.0);
    pilot.SetTask(Task::kChase, rest_);
    sees_target = true;
    Run(seconds);
    sees_target = false;
  }
  const Vector3d& home() const { return rest_; }

  Pilot pilot{PlanningConfig()};
  double t = 0.0, nearest = 1e9;
  bool flying_before = false, sees_target = false, hears = true;  // the last: of obstacles
  std::vector<world::Obstacle> obstacles;
  std::vector<PlanResult> plans;
  std::optional<PlanResult> flown;

 private:
  Vector3d rest_;
  std::optional<PlanResult> waiting_;
};

}  // namespace chase::planning::test
