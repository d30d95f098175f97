#include "deploy/worlds/layout.h"

#include <algorithm>

namespace chase::worlds {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

namespace {

constexpr int kAttempts = 40;         // for one solid
constexpr double kStartClear = 0.9;   // m around the chaser's start
constexpr double kSightClear = 0.45;  // m beside the first line of sight
constexpr double kWallThickness = 0.2;

/// Footprint distance: the solid is taken as if it had no end upwards and downwards.
double PlanDistance(const Solid& solid, const Vector2d& p) {
  return SignedDistance(solid, {p.x(), p.y(), solid.center.z()});
}

Solid Upright(const Vector2d& p, double radius) {
  return {Solid::Kind::kCylinder, {p.x(), p.y(), 0.0}, {radius, radius, 1.0}, 0.0};
}

}  // namespace

bool Area::Contains(const Vector2d& p, double margin) const {
  return (p - min).minCoeff() >= margin && (max - p).minCoeff() >= margin;
}

Vector2d Area::Point(Random* random, double margin) const {
  const double x = random->Uniform(min.x() + margin, max.x() - margin);
  return {x, random->Uniform(min.y() + margin, max.y() - margin)};
}

Area Centred(double length, double width) {
  return {{-0.5 * length, -0.5 * width}, {0.5 * length, 0.5 * width}};
}

void Enclose(const Area& area, double height, world::WorldSpec* world) {
  const double half = 0.5 * kWallThickness;
  const Vector2d a = area.min - Vector2d(half, half), b = area.max + Vector2d(half, half);
  const Vector2d corners[5] = {a, {b.x(), a.y()}, b, {a.x(), b.y()}, a};
  for (int i = 0; i < 4; ++i)
    world->walls.push_back({corners[i], corners[i + 1], height, kWallThickness});
}

KeptFree::KeptFree(const world::Scenario& scenario, double clearance) {
  const world::PathMotion path = world::TargetMotion(scenario);
  Vector2d last = path.Position(0.0);
  places_.push_back({last, clearance});
  for (double t = 0.0; t < path.Duration(); t += 0.02) {
    const Vector2d p = path.Position(t);
    if ((p - last).norm() < 0.1) continue;
    places_.push_back({last = p, clearance + 0.05});
  }
  on_way_ = places_.size();
  const Vector2d start = scenario.chaser.start.head<2>(), target = path.Position(0.0);
  places_.push_back({start, kStartClear});
  for (double s = 0.0; s < 1.0; s += 0.05)
    places_.push_back({start + s * (target - start), kSightClear});
  for (const auto& wall : scenario.world.walls) {
    const double steps = std::ceil((wall.to - wall.from).norm() / 0.2);
    for (double i = 0.0; i <= steps; ++i)
      places_.push_back({wall.from + i / steps * (wall.to - wall.from), 0.5 * wall.thickness});
  }
}

Vector2d KeptFree::Beside(double radius, Random* random) const {
  const auto i = static_cast<std::size_t>(Whole(random, 0, static_cast<int>(on_way_) - 1));
  const double away = places_[i].distance + radius + random->Uniform();
  return places_[i].p + Polar(random->Uniform(0.0, 2.0 * kPi), away);
}

bool KeptFree::Allows(const Solid& solid) const {
  return std::all_of(places_.begin(), places_.end(), [&](const Place& place) {
    return PlanDistance(solid, place.p) >= place.distance;
  });
}

bool Placer::Take(const Solid& solid, double gap) {
  const Vector2d center = solid.center.head<2>();
  const double radius = solid.kind == Solid::Kind::kBox ? solid.half_size.head<2>().norm()
                                                        : solid.half_size.head<2>().maxCoeff();
  for (const Taken& other : taken_)
    if ((other.center - center).norm() < other.radius + radius + gap) return false;
  if (!free_.Allows(solid)) return false;
  taken_.push_back({center, radius});
  return true;
}

Vector2d Placer::Spot(double radius, double margin) {
  if (!Chance(random_, 0.5)) return area_.Point(random_, margin);
  const Vector2d p = free_.Beside(radius, random_);
  return area_.Contains(p, margin) ? p : area_.Point(random_, margin);
}

void Placer::Trees(int count, double gap, world::Scenario* scenario) {
  for (int i = 0, tries = 0; i < count && tries < kAttempts * count; ++tries) {
    world::TreeSpec tree;
    tree.trunk_radius = random_->Uniform(0.12, 0.4);
    tree.center = Spot(tree.trunk_radius, 0.0);
    tree.height = random_->Uniform(6.0, 10.0);
    tree.crown_radius = random_->Uniform(1.0, 2.0);
    tree.crown_base = random_->Uniform(4.5, 5.5);
    if (!Take(Upright(tree.center, tree.trunk_radius), gap)) continue;
    scenario->world.trees.push_back(tree);
    ++i;
  }
}

void Placer::Pillars(int count, double gap, double radius_min, double radius_max, double height,
                     world::Scenario* scenario) {
  for (int i = 0, tries = 0; i < count && tries < kAttempts * count; ++tries) {
    world::CylinderSpec pillar;
    pillar.radius = random_->Uniform(radius_min, radius_max);
    pillar.center = Spot(pillar.radius, pillar.radius);
    pillar.height = height;
    if (!Take(Upright(pillar.center, pillar.radius), gap)) continue;
    scenario->world.cylinders.push_back(pillar);
    ++i;
  }
}

void Placer::Boxes(int count, double gap, const Vector3d& size, double variation, bool square,
                   world::Scenario* scenario) {
  for (int i = 0, tries = 0; i < count && tries < kAttempts * count; ++tries) {
    world::BoxSpec box;
    for (int k = 0; k < 3; ++k)
      box.size[k] = size[k] * random_->Uniform(1.0 - variation, 1.0 + variation);
    const Vector2d p = Spot(0.5 * box.size.head<2>().norm(), 0.0);
    box.yaw_deg = square ? 90.0 * Whole(random_, 0, 1) : random_->Uniform(0.0, 180.0);
    const double foot = world::GroundHeight(scenario->world.ground, p.x(), p.y());
    box.center = {p.x(), p.y(), foot + 0.5 * box.size.z()};
    const Solid solid{Solid::Kind::kBox, box.center, 0.5 * box.size, box.yaw_deg * kPi / 180.0};
    const double reach = 0.5 * box.size.head<2>().norm();
    const bool inside = area_.Contains(p, square ? 0.5 * box.size.head<2>().maxCoeff() : reach);
    if (!inside || !Take(solid, gap)) continue;
    scenario->world.boxes.push_back(box);
    ++i;
  }
}

void Placer::Boulders(int count, double gap, world::Scenario* scenario) {
  for (int i = 0, tries = 0; i < count && tries < kAttempts * count; ++tries) {
    world::EllipsoidSpec boulder;
    boulder.radii = {random_->Uniform(0.4, 1.5), random_->Uniform(0.4, 1.5),
                     random_->Uniform(0.4, 1.6)};
    const Vector2d p = Spot(boulder.radii.head<2>().maxCoeff(), 0.0);
    const double foot = world::GroundHeight(scenario->world.ground, p.x(), p.y());
    boulder.center = {p.x(), p.y(), foot + 0.2 * boulder.radii.z()};
    boulder.yaw_deg = random_->Uniform(0.0, 180.0);
    if (!Take(
            {Solid::Kind::kEllipsoid, boulder.center, boulder.radii, boulder.yaw_deg * kPi / 180.0},
            gap))
      continue;
    scenario->world.ellipsoids.push_back(boulder);
    ++i;
  }
}

}  // namespace chase::worlds
