#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/world/obstacle.h"
#include "common/world/state.h"
#include "common/world/trajectory.h"

namespace chase::world {

/// Where the target was seen at a past time t < 0 s.
struct Observation {
  double t = 0.0;                                            ///< s
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();            ///< p_WT, frame W, m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< m^2, positive definite
};

/// One planning or prediction problem from a file. Time 0 is the start of the horizon.
struct Scene {
  double horizon_s = 0.0;
  bool has_initial = false;
  State initial;  ///< of the drone
  bool has_target = false;
  Trajectory target;  ///< over [0, horizon_s]
  std::vector<Obstacle> obstacles;
  std::vector<Observation> observations;
  std::string planner;    ///< overrides of the planner's config as YAML text, may be empty
  std::string predictor;  ///< overrides of the predictor's config as YAML text, may be empty
};

constexpr std::size_t kMaxSceneObstacles = 2000;
constexpr std::size_t kMaxSceneBytes = 4 * 1024 * 1024;
constexpr int kMaxSceneDegree = 7;

/// Reads a scene file (keys: deploy/scenarios/scenes/README.md). Throws std::runtime_error with one
/// line "file:line: what" for anything malformed: missing or unknown keys, numbers that are not
/// finite, a horizon that is not above zero, rows of wrong length, shapes or covariances that are
/// not symmetric positive definite, too many obstacles.
Scene LoadScene(const std::string& file);
Scene ParseScene(const std::string& yaml, const std::string& origin);

}  // namespace chase::world
