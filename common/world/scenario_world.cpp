#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "common/world/random.h"
#include "common/world/scenario.h"

namespace chase::world {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kRootDepth = 0.3;  // m that a trunk reaches below the ground

double Radians(double degrees) { return degrees * kPi / 180.0; }

Solid WallSolid(const WallSpec& wall, double ground) {
  const Vector2d along = wall.to - wall.from, middle = 0.5 * (wall.to + wall.from);
  return {Solid::Kind::kBox, Vector3d(middle.x(), middle.y(), ground + 0.5 * wall.height),
          0.5 * Vector3d(along.norm(), wall.thickness, wall.height),
          std::atan2(along.y(), along.x())};
}

Solid Upright(const Vector2d& center, double radius, double from, double to) {
  return {Solid::Kind::kCylinder, Vector3d(center.x(), center.y(), 0.5 * (from + to)),
          Vector3d(radius, radius, 0.5 * (to - from)), 0.0};
}

/// Trunk, and crown unless its radius is 0. Heights count from the ground under the trunk.
void AddTree(const TreeSpec& tree, const GroundSpec& ground, std::vector<Solid>* solids) {
  const double foot = GroundHeight(ground, tree.center.x(), tree.center.y());
  const double crown = foot + 0.5 * (tree.crown_base + tree.height);
  const bool bare = tree.crown_radius <= 0.0;
  solids->push_back(Upright(tree.center, tree.trunk_radius, foot - kRootDepth,
                            bare ? foot + tree.height : crown));
  if (bare) return;
  const double half = 0.5 * (tree.height - tree.crown_base);
  solids->push_back({Solid::Kind::kEllipsoid, Vector3d(tree.center.x(), tree.center.y(), crown),
                     Vector3d(tree.crown_radius, tree.crown_radius, half), 0.0});
}

std::vector<Vector2d> SampledPath(const Scenario& scenario) {
  const PathMotion path = TargetMotion(scenario);
  std::vector<Vector2d> points;
  for (double t = 0.0; t <= path.Duration(); t += 0.05) points.push_back(path.Position(t));
  return points;
}

bool Fits(const TreeSpec& tree, const std::vector<TreeSpec>& others, double gap) {
  return std::all_of(others.begin(), others.end(), [&](const TreeSpec& other) {
    const double apart = gap + tree.trunk_radius + other.trunk_radius;
    return (tree.center - other.center).squaredNorm() >= apart * apart;
  });
}

/// A place that no trunk may come nearer to than `distance`.
struct FreePlace {
  Vector2d center;
  double distance;
};

bool Clear(const TreeSpec& tree, const std::vector<FreePlace>& places) {
  return std::all_of(places.begin(), places.end(), [&](const FreePlace& place) {
    const double apart = place.distance + tree.trunk_radius;
    return (tree.center - place.center).squaredNorm() >= apart * apart;
  });
}

/// Along the target's path, around the chaser's start, and where the movers' bodies pass.
std::vector<FreePlace> FreePlaces(const Scenario& scenario) {
  const double clearance = scenario.world.forest.path_clearance;
  std::vector<FreePlace> places = {{scenario.chaser.start.head<2>(), clearance}};
  for (const Vector2d& p : SampledPath(scenario)) places.push_back({p, clearance});
  for (const auto& mover : scenario.movers) {
    const double reach = 0.5 * mover.size.head<2>().norm() + 0.3;
    for (double t = 0.0; t <= scenario.duration_s; t += 0.1)
      places.push_back({MoverAt(mover, t).solid.center.head<2>(), reach});
  }
  return places;
}

/// Random sequential placement: a tree stands where it keeps the gap to those placed before it and
/// leaves the free places free. May end short of `count`.
std::vector<TreeSpec> GrowForest(const Scenario& scenario) {
  const ForestSpec& forest = scenario.world.forest;
  std::vector<TreeSpec> trees;
  if (forest.count <= 0) return trees;
  const auto places = FreePlaces(scenario);
  Random random(static_cast<uint64_t>(forest.seed));
  const int attempts = 400 * forest.count;
  for (int i = 0; i < attempts && static_cast<int>(trees.size()) < forest.count; ++i) {
    TreeSpec tree;
    tree.center.x() = random.Uniform(forest.min.x(), forest.max.x());
    tree.center.y() = random.Uniform(forest.min.y(), forest.max.y());
    tree.trunk_radius = random.Uniform(forest.trunk_radius_min, forest.trunk_radius_max);
    tree.height = random.Uniform(7.0, 10.0);
    tree.crown_radius = random.Uniform(1.0, 1.8);
    tree.crown_base = random.Uniform(4.5, 5.5);
    if (Fits(tree, trees, forest.gap) && Clear(tree, places)) trees.push_back(tree);
  }
  return trees;
}

std::vector<Vector3d> ReadSamples(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file + ": target.path_file cannot be read; check the path");
  std::vector<Vector3d> samples;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line.find_first_not_of("0123456789+-.eE, \t\r") != std::string::npos)
      continue;  // headings
    Vector3d sample;
    if (std::sscanf(line.c_str(), "%lf , %lf , %lf", &sample[0], &sample[1], &sample[2]) != 3 ||
        (!samples.empty() && sample.x() <= samples.back().x()))
      throw std::runtime_error(file + ":" + std::to_string(number) +
                               ": expected t,x,y with t growing");
    samples.push_back(sample);
  }
  if (samples.size() < 2) throw std::runtime_error(file + ": needs two samples t,x,y or more");
  return samples;
}

/// Position along a polygon at distance s from its first corner, and the leg's direction.
struct OnPolygon {
  Vector3d position, direction;
  bool at_end;
};

double PolygonLength(const std::vector<Vector3d>& corners) {
  double length = 0.0;
  for (std::size_t i = 1; i < corners.size(); ++i) length += (corners[i] - corners[i - 1]).norm();
  return length;
}

OnPolygon Along(const std::vector<Vector3d>& corners, double s) {
  Vector3d direction = Vector3d::UnitX();
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vector3d leg = corners[i] - corners[i - 1];
    if (leg.norm() <= 0.0) continue;
    direction = leg.normalized();
    if (s < leg.norm()) return {corners[i - 1] + s * direction, direction, false};
    s -= leg.norm();
  }
  return {corners.back(), direction, true};
}

/// Where a mover is, which way it faces, and how it moves.
struct OnWay {
  Vector3d position, direction, velocity;
};

OnWay AtSpeed(const MoverSpec& mover, double t) {
  auto corners = mover.waypoints;
  if (mover.loop && !corners.empty()) corners.push_back(corners.front());
  const double length = PolygonLength(corners);
  double s = std::max(0.0, t - mover.start_time) * mover.speed;
  if (mover.loop && length > 0.0) s = std::fmod(s, length);
  const OnPolygon on = Along(corners, s);
  const bool moves = t >= mover.start_time && !on.at_end;
  return {on.position, on.direction,
          moves ? Vector3d(mover.speed * on.direction) : Vector3d::Zero()};
}

/// It faces the way of its last leg that had a length.
OnWay AtTimes(const MoverSpec& mover, double t) {
  const auto& p = mover.waypoints;
  const auto& times = mover.times;
  const auto after =
      static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), t) - times.begin());
  const std::size_t leg = std::clamp<std::size_t>(after, 1, std::max<std::size_t>(1, p.size() - 1));
  OnWay on{p.front(), Vector3d::UnitX(), Vector3d::Zero()};
  for (std::size_t i = std::min(leg, p.size() - 1); i > 0; --i) {
    if (p[i] == p[i - 1]) continue;
    on.direction = (p[i] - p[i - 1]).normalized();
    break;
  }
  if (after == 0) return on;
  on.position = p[after - 1];
  if (after == p.size()) return on;
  on.velocity = (p[after] - p[after - 1]) / (times[after] - times[after - 1]);
  on.position += (t - times[after - 1]) * on.velocity;
  return on;
}

}  // namespace

double GroundHeight(const GroundSpec& ground, double x, double y) {
  const double plane = ground.height + ground.slope.dot(Vector2d(x, y));
  if (ground.roughness == 0.0) return plane;
  const double k = 2.0 * kPi / ground.wavelength;
  const double wave = std::sin(k * x + 0.3) * std::cos(0.8 * k * y) +
                      0.5 * std::sin(1.7 * k * y + 1.1) * std::cos(1.3 * k * x);
  return plane + ground.roughness * wave / 1.5;
}

std::vector<Solid> StaticSolids(const Scenario& scenario) {
  const WorldSpec& world = scenario.world;
  std::vector<Solid> solids;
  for (const auto& wall : world.walls) solids.push_back(WallSolid(wall, world.ground.height));
  for (const auto& box : world.boxes)
    solids.push_back({Solid::Kind::kBox, box.center, 0.5 * box.size, Radians(box.yaw_deg)});
  for (const auto& c : world.cylinders)
    solids.push_back(Upright(c.center, c.radius, c.base, c.base + c.height));
  for (const auto& e : world.ellipsoids)
    solids.push_back({Solid::Kind::kEllipsoid, e.center, e.radii, Radians(e.yaw_deg)});
  for (const auto& tree : world.trees) AddTree(tree, world.ground, &solids);
  for (const auto& tree : GrowForest(scenario)) AddTree(tree, world.ground, &solids);
  return solids;
}

PathMotion TargetMotion(const Scenario& scenario) {
  const TargetSpec& target = scenario.target;
  if (!target.path_file.empty()) return PathMotion(ReadSamples(target.path_file));
  PathMotion::Stops stops;
  for (const auto& stop : target.stops) stops.emplace_back(stop.waypoint, stop.duration);
  return {target.waypoints,
          {target.speed, target.acceleration, target.lateral_acceleration},
          target.corner_radius,
          stops};
}

Solid TargetSolid(const TargetSpec& target, const Vector3d& center, double yaw) {
  const Vector3d half(target.radius, target.radius, 0.5 * target.height);
  if (target.shape == "box") return {Solid::Kind::kBox, center, half, yaw};
  const bool sphere = target.shape == "sphere";
  return {sphere ? Solid::Kind::kEllipsoid : Solid::Kind::kCylinder, center, half, 0.0};
}

MoverState MoverAt(const MoverSpec& mover, double t) {
  const OnWay on = mover.times.empty() ? AtSpeed(mover, t) : AtTimes(mover, t);
  MoverState state;
  state.solid.kind = mover.shape == "box"        ? Solid::Kind::kBox
                     : mover.shape == "cylinder" ? Solid::Kind::kCylinder
                                                 : Solid::Kind::kEllipsoid;
  state.solid.center = on.position;
  state.solid.half_size = 0.5 * mover.size;
  state.solid.yaw = std::atan2(on.direction.y(), on.direction.x());
  state.velocity = on.velocity;
  return state;
}

}  // namespace chase::world
