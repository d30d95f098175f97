#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/world/fault.h"
#include "common/world/path_motion.h"
#include "common/world/shapes.h"

namespace chase::world {

// The structs below mirror the keys of a scenario file (deploy/scenarios/README.md). Lengths m,
// speeds m/s, times s, angles as named; frame W. Each Problem() names the first field that makes no
// sense, its value and the limit, and is empty when all is well.

struct WallSpec {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::UnitX();
  double height = 3.0, thickness = 0.2;
  template <class V>
  void Visit(V& v) {
    v("from", from, "x y, m");
    v("to", to, "x y, m");
    v("height", height, "m");
    v("thickness", thickness, "m");
  }
  std::string Problem() const;
};

struct BoxSpec {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), size = Eigen::Vector3d::Ones();
  double yaw_deg = 0.0;
  template <class V>
  void Visit(V& v) {
    v("center", center, "m");
    v("size", size, "edges, m");
    v("yaw_deg", yaw_deg, "about z");
  }
  std::string Problem() const;
};

struct CylinderSpec {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius = 0.28, height = 3.0, base = 0.0;
  template <class V>
  void Visit(V& v) {
    v("center", center, "x y, m");
    v("radius", radius, "m");
    v("height", height, "m");
    v("base", base, "z of the lower end, m");
  }
  std::string Problem() const;
};

struct EllipsoidSpec {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), radii = Eigen::Vector3d::Ones();
  double yaw_deg = 0.0;
  template <class V>
  void Visit(V& v) {
    v("center", center, "m");
    v("radii", radii, "semi-axes, m");
    v("yaw_deg", yaw_deg, "about z");
  }
  std::string Problem() const;
};

struct TreeSpec {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double trunk_radius = 0.25, height = 8.0, crown_radius = 1.5, crown_base = 4.5;
  template <class V>
  void Visit(V& v) {
    v("center", center, "x y, m");
    v("trunk_radius", trunk_radius, "m");
    v("height", height, "m");
    v("crown_radius", crown_radius, "m");
    v("crown_base", crown_base, "z of the crown's lower end, m");
  }
  std::string Problem() const;
};

/// Random trees, drawn from the scenario's own seed so that every flight has the same map.
struct ForestSpec {
  int count = 0;
  Eigen::Vector2d min = Eigen::Vector2d::Zero(), max = Eigen::Vector2d::Zero();
  double gap = 2.5, trunk_radius_min = 0.15, trunk_radius_max = 0.4, path_clearance = 1.0;
  int seed = 1;
  template <class V>
  void Visit(V& v) {
    v("count", count, "trees; 0: none");
    v("min", min, "corner x y, m");
    v("max", max, "corner x y, m");
    v("gap", gap, "smallest free gap between trunks, m");
    v("trunk_radius_min", trunk_radius_min, "m");
    v("trunk_radius_max", trunk_radius_max, "m");
    v("path_clearance", path_clearance, "free distance kept to the target's path, m");
    v("seed", seed, "of the generator");
  }
  std::string Problem() const;
};

struct GroundSpec {
  double height = 0.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double roughness = 0.0, wavelength = 8.0;
  template <class V>
  void Visit(V& v) {
    v("height", height, "z at the origin, m");
    v("slope", slope, "rise per metre along x and y");
    v("roughness", roughness, "amplitude of undulation, m");
    v("wavelength", wavelength, "of undulation, m");
  }
  std::string Problem() const;
};

struct WorldSpec {
  GroundSpec ground;
  std::vector<WallSpec> walls;
  std::vector<BoxSpec> boxes;
  std::vector<CylinderSpec> cylinders;
  std::vector<EllipsoidSpec> ellipsoids;
  std::vector<TreeSpec> trees;
  ForestSpec forest;
  template <class V>
  void Visit(V& v) {
    v("ground", ground, "");
    v("walls", walls, "");
    v("boxes", boxes, "");
    v("cylinders", cylinders, "");
    v("ellipsoids", ellipsoids, "");
    v("trees", trees, "");
    v("forest", forest, "generator");
  }
  std::string Problem() const;
};

struct MoverSpec {
  std::string shape = "box";  // box, cylinder or ellipsoid
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  std::vector<Eigen::Vector3d> waypoints;
  std::vector<double> times;  // mission times at the waypoints instead of speed, or empty, s
  double speed = 1.0, start_time = 0.0;
  bool loop = false;
  template <class V>
  void Visit(V& v) {
    v("shape", shape, "box, cylinder or ellipsoid");
    v("size", size, "length width height, m");
    v("waypoints", waypoints, "of the centre, m");
    v("times", times, "mission time at each waypoint, instead of speed, start_time and loop, s");
    v("speed", speed, "m/s");
    v("start_time", start_time, "mission time at which it starts, s");
    v("loop", loop, "back to the first waypoint");
  }
  std::string Problem() const;
};

/// The target rests on a waypoint and turns there on the spot.
struct StopSpec {
  int waypoint = 0;
  double duration = 0.0;
  template <class V>
  void Visit(V& v) {
    v("waypoint", waypoint, "number of the waypoint, from 0");
    v("duration", duration, "s; 0: only turns");
  }
  std::string Problem() const;
};

struct TargetSpec {
  std::string shape = "cylinder";  // cylinder, box or sphere
  double radius = 0.15, height = 0.5, base = 0.3;
  Eigen::Vector3d color = {1.0, 0.45, 0.05};
  Eigen::Vector3d carrier_size = {0.5, 0.4, 0.3};
  std::vector<Eigen::Vector2d> waypoints;
  std::string path_file;  // CSV t,x,y instead of waypoints, relative to the scenario file
  std::vector<StopSpec> stops;
  double speed = 1.0, acceleration = 0.5, lateral_acceleration = 0.0, corner_radius = 0.8;
  template <class V>
  void Visit(V& v) {
    v("shape", shape, "cylinder (upright), box (square from above) or sphere");
    v("radius", radius, "of the cylinder or sphere; of the box half an edge, m");
    v("height", height, "of the cylinder or box; of the sphere twice the radius, m");
    v("base", base, "z of the lower end above the ground, m");
    v("color", color, "r g b, 0 to 1");
    v("carrier_size", carrier_size, "box that carries it, length width height, m; zeros: none");
    v("waypoints", waypoints, "on the ground, x y, m");
    v("path_file", path_file, "CSV t,x,y instead of waypoints");
    v("stops", stops, "waypoints where it rests and turns on the spot");
    v("speed", speed, "greatest, m/s");
    v("acceleration", acceleration, "along the path, m/s^2");
    v("lateral_acceleration", lateral_acceleration,
      "corners are taken no faster than this allows, m/s^2; 0: at full speed");
    v("corner_radius", corner_radius, "corners are rounded to this, m");
  }
  std::string Problem() const;
};

struct ChaserSpec {
  Eigen::Vector3d start = {0.0, 0.0, 0.0};
  double yaw_deg = 0.0, takeoff_height = 1.5, desired_distance = 2.5, radius = 0.25;
  template <class V>
  void Visit(V& v) {
    v("start", start, "where it stands before take-off, m");
    v("yaw_deg", yaw_deg, "at the start");
    v("takeoff_height", takeoff_height,
      "m above the start; it hovers there until the target moves");
    v("desired_distance", desired_distance, "l_des, m");
    v("radius", radius, "of the drone's sphere, m");
  }
  std::string Problem() const;
};

struct SensorsSpec {
  std::string mode = "raw";  // raw or truth
  template <class V>
  void Visit(V& v) {
    v("mode", mode, "raw: sensors only; truth: true state, target and obstacles");
  }
  std::string Problem() const;
};

struct WindSpec {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double gust = 0.0, gust_time = 2.0;
  template <class V>
  void Visit(V& v) {
    v("mean", mean, "m/s");
    v("gust", gust, "standard deviation, m/s");
    v("gust_time", gust_time, "correlation time, s");
  }
  std::string Problem() const;
};

/// Limits that a flight must keep to pass; a negative limit is not checked.
struct CriteriaSpec {
  double safe_ratio = 1.0, visible_ratio = 0.95, in_image_ratio = 0.9;
  double distance_ratio_max = -1.0, real_time_factor = -1.0;
  std::vector<std::string> flight_states;
  double touchdown_speed = -1.0, motors_off = -1.0;
  double sweep_to_setpoint = -1.0, memory_growth = -1.0;
  int restarts = -1;
  template <class V>
  void Visit(V& v) {
    v("safe_ratio", safe_ratio, "at least");
    v("visible_ratio", visible_ratio, "at least");
    v("in_image_ratio", in_image_ratio, "at least");
    v("distance_ratio_max", distance_ratio_max, "at most");
    v("real_time_factor", real_time_factor, "at least; live flights only");
    v("flight_states", flight_states, "that the flight is in, in this order, others between them");
    v("touchdown_speed", touchdown_speed, "at most, m/s");
    v("motors_off", motors_off, "after touchdown, at most, s");
    v("sweep_to_setpoint", sweep_to_setpoint, "99th percentile, at most, s; logs with sweeps only");
    v("memory_growth", memory_growth,
      "of any process after its first minute, at most; live flights only");
    v("restarts", restarts, "of any process, at most, besides those that faults kill or freeze");
  }
};

/// What an operator commands during the flight: an entry of a scenario's `commands`.
struct CommandSpec {
  std::string command;
  double at_s = 0.0;
  std::vector<double> at_px;
  template <class V>
  void Visit(V& v) {
    v("command", command, "takeoff, chase, hold, search, return, land, stop, kill or select");
    v("at_px", at_px, "of select: column and row in the image");
    v("at_s", at_s, "mission time, s; negative: before the target moves");
  }
  std::string Problem() const;
};

/// One override of a service's config: `services: [{name: planning, config: "horizon: 2.5"}]`.
struct ServiceOverride {
  std::string name;
  std::string config;  // YAML text, as the service's --config file
  template <class V>
  void Visit(V& v) {
    v("name", name, "service");
    v("config", config, "its overrides as YAML text");
  }
  std::string Problem() const;
};

struct Scenario {
  std::string name, description;
  double duration_s = 60.0;
  double settle_s = 8.0;
  WorldSpec world;
  std::vector<MoverSpec> movers;
  TargetSpec target;
  ChaserSpec chaser;
  SensorsSpec sensors;
  WindSpec wind;
  CriteriaSpec criteria;
  std::vector<FaultSpec> faults;
  std::vector<CommandSpec> commands;
  std::vector<ServiceOverride> services;
  template <class V>
  void Visit(V& v) {
    v("name", name, "");
    v("description", description, "one sentence");
    v("duration_s", duration_s, "of the mission, s");
    v("settle_s", settle_s,
      "from power-on to mission time zero, when the target starts to move, s");
    v("world", world, "");
    v("movers", movers, "");
    v("target", target, "");
    v("chaser", chaser, "");
    v("sensors", sensors, "");
    v("wind", wind, "");
    v("criteria", criteria, "");
    v("faults", faults, "what goes wrong");
    v("commands", commands, "of an operator; none: it takes off and chases by itself");
    v("services", services, "");
  }
  /// Names the first field that makes no sense, its value and the limit; empty when all is well.
  std::string Problem() const;
};

/// Reads a scenario file; throws std::runtime_error with one line "file:line: what". Paths inside
/// are made absolute.
Scenario LoadScenario(const std::string& file);
Scenario ParseScenario(const std::string& yaml, const std::string& origin);

/// The overrides of one service as YAML text, empty if none.
std::string ServiceConfig(const Scenario& scenario, const std::string& service);

/// All static solids of the scenario, generators run: walls, boxes, cylinders, ellipsoids, trunks,
/// crowns. The ground is not among them.
std::vector<Solid> StaticSolids(const Scenario& scenario);

/// Height of the ground at x, y [m].
double GroundHeight(const GroundSpec& ground, double x, double y);

/// The target's own solid, its carrier left out, about p_WT [m]; `yaw` of the carrier [rad].
Solid TargetSolid(const TargetSpec& target, const Eigen::Vector3d& center, double yaw);

/// Motion of the target's centre over the ground from mission time 0; reads `path_file` if there is
/// one.
PathMotion TargetMotion(const Scenario& scenario);

/// Centre and velocity of a mover and its solid at mission time t.
struct MoverState {
  Solid solid;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};
MoverState MoverAt(const MoverSpec& mover, double t);

}  // namespace chase::world
