#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/world/ages.h"
#include "common/world/obstacle.h"
#include "common/world/trajectory.h"

/// What the page draws. Times are seconds from one origin, everything else is in frame W, SI.
namespace chase::viewer {

/// How old an input may be and still be shown as what is, s: as old as those who need it let it be.
struct MostShownAge {
  double pose = 0.5;  ///< logs from elsewhere have ten a second, and jitter
  double target = world::kMostAge.target;
  double plan = 0.5;  ///< nobody has a limit: 0.4 s after its start control goes over to its stop
  double forecast = world::kMostAge.prediction;
  double obstacles = world::kMostAge.obstacles;
  double flight = world::kMostAge.flight_state;
  double tracking = world::kMostAge.tracking;
  double image = 1.0;  ///< twenty frames of the camera
};
inline constexpr MostShownAge kMostShownAge;

struct Drone {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero(), v_WB = Eigen::Vector3d::Zero();
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  int health = 0;      ///< pose_t's constants
  std::string reason;  ///< why it is not OK
  double age = 0.0;    ///< since it was heard, s
};

struct Target {
  int state = 0;  ///< target_t's constants
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero(), v_WT = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of p_WT, m^2
  double radius = 0.0, height = 0.0;                     ///< of its upright cylinder, m
  Eigen::Vector4d box_px = Eigen::Vector4d::Zero();      ///< centre u v, width, height
  double existence = 0.0;                                ///< probability, 0 to 1
  std::string reason;
  double age = 0.0;  ///< since it was heard, s

  /// Are mean and covariance usable?
  bool Known() const { return state == 1 || state == 2; }
};

struct Plan {
  int verdict = 0;  ///< plan_t's constants
  std::string reason;
  world::Trajectory path;
  std::optional<world::Trajectory> stop;  ///< certified, leaves `path` at its start
  double clearance = -1.0;                ///< certified, m; negative: not certified
  double radius = 0.0;                    ///< of the sphere that is kept free at least, m
  double age = 0.0;                       ///< since it was heard, s
};

struct Forecast {
  int verdict = 0;  ///< prediction_t's constants
  world::Trajectory path;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();           ///< at its start, m^2
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< m^2/s^2
  double age = 0.0;                                               ///< since it was heard, s
};

/// Where the flight is, as the mission process says.
struct Flight {
  int state = 0;                     ///< flight_state_t's constants
  std::string reason;                ///< what led to it
  double since = 0.0;                ///< when it began, s
  std::vector<std::string> missing;  ///< what READY waits for
  double age = 0.0;                  ///< since it was heard, s
};

/// What the controller follows.
struct Tracking {
  int following = 0;  ///< tracking_t's constants
  double age = 0.0;   ///< since it was heard, s
};

/// Where it may fly: a polygon seen from above, between two heights.
struct Fence {
  std::vector<Eigen::Vector2d> corners;  ///< m
  double floor = 0.0, ceiling = 0.0;     ///< z, m
};

/// Where a simulation had somebody.
struct Body {
  Eigen::Vector3d p;     ///< of its centre, m
  Eigen::Quaterniond R;  ///< from its own axes, x forward
};

/// The newest of everything.
struct Scene {
  int64_t utime = 0;  ///< when it is told, by the bus's clock, us
  std::optional<Drone> drone;
  std::optional<Target> target;
  std::optional<Plan> plan;
  std::optional<Forecast> forecast;
  std::optional<Flight> flight;
  std::optional<Tracking> tracking;
  std::optional<Fence> fence;
  std::optional<double> obstacles_age, image_age;  ///< since they were heard, s; none: never
  std::vector<Body> truth;                         ///< drone, target, movers; empty: not known
  double plan_ms = -1.0;  ///< mean time per plan of the last second; negative: not known
  int processes = -1;     ///< worst state of a process, status_t's constants; -1: none is heard
  std::set<std::string> faults;  ///< that a test flight does to itself, by name
  std::string scenario;          ///< its name; empty: none
};

/// Semi-axes and orientation of the ellipsoid { x : x' S^-1 x <= 1 }, S symmetric; zeros where S is
/// not finite, and along axes in which it is not positive.
struct Axes {
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
};
Axes AxesOf(const Eigen::Matrix3d& S);

/// The solid that is drawn for an obstacle: `half` are half edges, (radius, radius, half height) or
/// semi-axes.
struct Solid {
  Eigen::Vector3d center, velocity, half;
  Eigen::Quaterniond R;
};
Solid SolidOf(const world::Obstacle& obstacle, double t);

/// Standard deviation [m] of the forecast `dt` seconds from its start, the largest over directions:
/// of the place and the velocity it started with, and of the manoeuvres that planning expects.
double SpreadAt(const Forecast& forecast, double dt);

}  // namespace chase::viewer
