#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "common/math/polynomial.h"
#include "common/world/body.h"
#include "services/planning/enlargement.h"
#include "services/planning/planner.h"

namespace chase::planning {

/// The LiDAR sees what is below along this slope: 15 degrees, less a tilt of 4.
inline constexpr double kSightSlope = 0.2;
/// Acceleration where no limit is set, m/s^2.
inline constexpr double kPush = 4.0;

using world::Curve;

/// Sight from this tau on: it is not asked for.
inline constexpr double kNoSight = 1.0;

/// An obstacle as the planner sees it: the true ellipsoid grown for the drone's safety and, less,
/// for the line of sight.
struct Ellipsoid {
  int id = 0;
  int index = -1;  ///< in the request's list; -1: not one of it
  Curve center;
  Eigen::Matrix3d safety;  ///< must not hold the drone's centre
  Eigen::Matrix3d sight;   ///< must not cross the segment from drone to target
  /// Half the sides of boxes around the two; infinite where nobody has worked them out.
  Eigen::Array3d safety_half = Eigen::Array3d::Constant(HUGE_VAL), sight_half = safety_half;
  /// What the two are grown from and by, m; negative where a margin has given way.
  Eigen::Matrix3d grown_from = Eigen::Matrix3d::Zero();
  double grown_by[2] = {-1.0, -1.0};
  /// tau from which safety is asked; above 0 only if the start is inside
  double safety_from = 0.0;
  double sight_from = 0.0;  ///< tau from which sight is asked; kNoSight: never
  bool ground = false;      ///< what the target stands on: hides nothing
  /// What the ellipsoids stand for; nothing: for themselves. Else they only sort out candidates,
  /// and the proof is about the body's Minkowski sums.
  std::optional<world::Body> body;
  double safety_radius = 0.0;  ///< of the ball about the drone, m: hard radius and what is left of
                               ///< the margin
  double sight_share = 1.0;    ///< of the sight's margin and of the target's uncertainty
};

/// The ground about the start, as a plane.
struct Ground {
  double slope_x = 0.0, slope_y = 0.0, z0 = 0.0;  ///< z = slope_x x + slope_y y + z0, frame W, m

  double Above(const Eigen::Vector3d& p) const { return Rise(p) - z0; }
  /// Of a displacement, over that of the ground.
  double Rise(const Eigen::Vector3d& d) const { return d.z() - slope_x * d.x() - slope_y * d.y(); }
};

/// Limits of the plan; infinity (or nothing) where there is none.
struct Limits {
  double speed = 0.0;               ///< m/s; 0: none
  double acceleration = 0.0;        ///< m/s^2; 0: none
  bool height = false;              ///< whether z_min and z_max apply
  double z_min = 0.0, z_max = 0.0;  ///< above the ground, m
  Ground ground;
  double tan_elevation = 0.0;  ///< of the target seen from the drone; 0: none
  double min_distance = 0.0;   ///< m; 0: none
  std::optional<View> view;    ///< that the target stays in, from above and below
  double view_from = 0.0;      ///< from this tau on
  Eigen::Vector2d listed_about = Eigen::Vector2d::Zero();
  double listed_within = HUGE_VAL;  ///< of it obstacles are listed, m
};

/// A box, frame W, m.
struct Box {
  Eigen::Array3d low, high;
};

/// Problem 2 of Jeon 2021 in normalised time, ready to be searched.
struct Problem {
  double t0 = 0.0;        ///< of tau = 0, s
  double duration = 1.0;  ///< T, s
  int degree = 5;         ///< of the candidates
  Curve start;            ///< first four power coefficients of every candidate
  Curve target;
  std::vector<Ellipsoid> obstacles;
  std::optional<Ellipsoid> target_body;  ///< to be kept off, like the obstacles; hides nothing
  double sigmas = 0.0;                   ///< that covariances are taken by
  double sight_radius = 0.0;             ///< margin of the line of sight, m
  /// `sigmas` deviations of the target's position, from above: power coefficients in tau, m.
  math::Polynomial target_growth = math::Polynomial::Zero(2);
  Limits limits;
  std::vector<std::vector<Eigen::Vector3d>> skeletons;  ///< [step][choice], frame W, m
  /// Holds the target and the plans that are considered; none: unlimited.
  std::optional<Box> reach;
  /// Indices of the obstacles that can matter within `reach`; meaningless without it.
  std::vector<int> near;
  int n_candidates() const;
};

/// Least squares over the corners of what is listed of the ground, by area; level at z = 0 where
/// nothing is.
Ground GroundOf(const std::vector<world::Obstacle>& obstacles);

/// Puts the request into normalised time, grows the obstacles and relaxes
/// what the start already breaks; `notes` gets one clause for each such relaxation that weakens the
/// certificate. Leaves the skeletons empty.
Problem MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes);
/// The same in the memory of an earlier problem, over another stretch and with obstacles `besides`
/// the request's, which come last, where that is asked for.
void MakeProblem(const PlannerConfig& config, const PlanRequest& request, const Stretch& over,
                 std::string* notes, Problem* problem,
                 const std::vector<world::Obstacle>& besides = {});

/// The problem with the obstacles near its reach (all, where there is none) only, enlarged by
/// `room` m to all sides where the start and the target, for sight also the line of sight at the
/// start, stay outside; without skeletons.
void WithRoom(const Problem& problem, double room, Enlargements* memory, Problem* roomy);

/// `trajectory` over [start, start + duration] in normalised time.
Curve ToCurve(const world::Trajectory& trajectory, double start, double duration);

/// Value of the curve's derivative of the given order with respect to tau.
Eigen::Vector3d Evaluate(const Curve& curve, double tau, int order = 0);

}  // namespace chase::planning
