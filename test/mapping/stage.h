#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/world/random.h"
#include "common/world/scenario.h"
#include "services/mapping/sweep.h"
#include "services/mapping/target_zone.h"
#include "services/simulator/actors.h"
#include "services/simulator/lidar.h"

/// Flights for mapping made with the simulator's own world and LiDAR: the drone moves on rails,
/// registered sweeps carry errors of ranges and poses, the target's estimate carries its own.
namespace chase::mapping_stage {

struct Errors {
  double range = 0.02;   ///< standard deviation, m
  double pose = 0.01;    ///< of a sweep's position, per axis, independent from sweep to sweep, m
  double yaw = 0.001;    ///< the same of its heading, rad
  double target = 0.05;  ///< of the target's estimate, per axis, m
};

/// A flight: a world, what moves in it, and the drone's rails.
struct Course {
  std::string name;
  world::Scenario scenario;
  double duration = 60.0;     ///< s
  bool frozen = false;        ///< target and movers stand where they start; no target estimate
  double blind_period = 0.0;  ///< s; at the end of each such period the target ...
  double blind = 0.0;         ///< ... is not estimated for this long, s; 0: never
  std::function<Eigen::Vector3d(double)> place;           ///< of the drone at t, frame W, m
  Eigen::Vector2d low = Eigen::Vector2d::Constant(-1e9);  ///< free volume is judged within ...
  Eigen::Vector2d high = Eigen::Vector2d::Constant(1e9);  ///< ... these corners
};

/// What a return hit.
struct Hit {
  Eigen::Vector3d point;  ///< true place, frame W, m
  int solid = -1;         ///< index into the static solids, or -1
  int mover = -1;         ///< index of the mover, or -1
  double t = 0.0;         ///< s, when it was fired
};

struct Shot {
  mapping::Sweep sweep;                           ///< as odometry would register it
  std::optional<mapping::TargetEstimate> target;  ///< newest estimate
  std::vector<Hit> hits;                          ///< of solids and movers
  Eigen::Vector3d place;                          ///< of the drone, true
  simulator::TargetState true_target;
  std::vector<world::MoverState> movers;
};

class Stage {
 public:
  Stage(const Course& course, const Errors& errors, uint64_t seed);
  /// The next sweep; nothing after the course's end.
  std::optional<Shot> Next();
  const std::vector<world::Solid>& solids() const { return solids_; }
  /// Indices of the static solids that may lie within 3 m of (x, y).
  const std::vector<int>& Near(double x, double y) const;

 private:
  simulator::TimedPose Pose(double t) const;
  double Actual(double t) const { return course_.frozen ? 0.0 : t; }
  void Classify(const Eigen::Vector3d& p, double t, std::vector<Hit>* hits);
  void Observe(Shot* shot);

  Course course_;
  Errors errors_;
  std::vector<world::Solid> solids_;
  std::vector<std::vector<int>> bins_;
  simulator::Actors actors_;
  simulator::Scene scene_;
  simulator::Lidar lidar_;
  world::Random random_;
  std::vector<simulator::TimedPose> rail_;  ///< poses so far
  double t_ = 0.0;
  double movers_t_ = -1.0;  ///< s, when movers_ were there
  std::vector<world::MoverState> movers_;
};

/// The drone follows the target's path `delay` s behind it, `height` m above the ground.
Course Follow(const std::string& scenario, double delay, double height);
/// Two large movers cross at `speed` in front of the hovering drone, one behind a trunk.
Course Crossing(double speed);
/// The forest's flight with trees and movers of its own for every seed: boxes, cylinders and
/// ellipsoids, 0.8 to 3.5 m long, cut across the target's path at 1.5 to 4 m/s.
Course Traffic(uint64_t seed);
/// A straight flight of `length` m at 5 m/s through a forest.
Course Long(double length);

}  // namespace chase::mapping_stage
