#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "services/prediction/observation_window.h"
#include "services/prediction/predictor.h"

namespace chase::prediction {

/// A target's true motion and the obstacles around it.
struct Course {
  std::string name;
  std::vector<Eigen::Vector2d> truth;  ///< p_WT every 10 ms, m
  std::vector<world::Obstacle> obstacles;
  double target_radius = 0.15;  ///< m
};

/// The target of deploy/scenarios/gym.yaml among its pillars and walls.
Course GymCourse();
/// S1 to S12 with their maps, deploy/scenarios/twelve.
Course TwelveCourse(int number);
/// Along a corridor 2.4 m wide whose walls force turns of 90 degrees every 4 to 7 m.
Course CorridorCourse();
/// The target of a random world, nothing around.
Course WorldCourse(const std::string& kind, uint64_t seed);
/// Straight on at 1 m/s, nothing around.
Course StraightCourse();
/// Straights and curves, two of three of them 90 degrees at 0.8 m, with stops; nothing around.
Course DriveCourse(uint64_t seed);

/// Root mean squares of the error of a forecast after 0.5, 1 and 2.5 s, m.
using Errors = Eigen::Array3d;
constexpr double kAhead[] = {0.5, 1.0, 2.5};

struct AccuracyResult {
  Errors ours = Errors::Zero();
  Errors velocity_short = Errors::Zero();  ///< least-squares line over 0.5 s
  Errors velocity_long = Errors::Zero();   ///< over 1 s
  Errors acceleration = Errors::Zero();    ///< least-squares parabola over 2 s
  int forecasts = 0;
  int colliding = 0;  ///< forecasts with this verdict
};

/// A target seen at 20 Hz with `sigma` m of noise in x and y; a forecast every 0.25 s.
AccuracyResult MeasureAccuracy(const Course& course, const PredictorConfig& config,
                               const WindowConfig& window, double sigma, uint64_t seed);

/// Mean of the squares, then the root.
AccuracyResult Pooled(const std::vector<AccuracyResult>& results);

}  // namespace chase::prediction
