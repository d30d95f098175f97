#pragma once

#include <string>
#include <vector>

#include "common/world/obstacle.h"
#include "common/world/path_motion.h"
#include "services/planning/planning_config.h"

namespace chase::compare {

/// One scenario of the comparison: static obstacles, a target whose future is known.
struct Mission {
  std::string name;      ///< such as S7, or S7-seed3
  int seed = 1;          ///< of the map and the motion: the number after "-seed" in the name
  double duration = 50;  ///< s
  double desired_distance = 3, drone_radius = 0.3, target_height = 1;  ///< m
  std::vector<world::Obstacle> obstacles;                              ///< at their true size
  world::PathMotion path;
  planning::PlanningConfig planning;

  Eigen::Vector3d Target(double t) const;          ///< p_WT, m
  Eigen::Vector3d TargetVelocity(double t) const;  ///< v_WT, m/s
  /// Shapes R of the obstacles grown by the drone's radius: what safety and sight are scored
  /// against.
  std::vector<Eigen::Matrix3d> GrownShapes() const;
};

/// `scenario` is a file, or the name of one of the twelve. Throws std::runtime_error with one line;
/// obstacles must be ellipsoids.
Mission LoadMission(const std::string& scenario);
std::string ScenarioFile(const std::string& scenario);

/// Least-squares quintic of the target over [t0, t0 + horizon]: what planners are told.
world::Trajectory FitTarget(const Mission& mission, double t0, double horizon);

/// On the ring of the desired distance about the target, of 16 bearings the one whose line of sight
/// is clearest; moving as the target does.
world::State StartState(const Mission& mission);

}  // namespace chase::compare
