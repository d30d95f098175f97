#include <algorithm>

#include "deploy/worlds/kinds.h"

namespace chase::worlds {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Scenario;

namespace {

constexpr double kWayClear = 0.75;  // m from the target's way to what stands: gates from 1.5 m

TargetLimits Indoors(double speed_max) { return {0.5, speed_max, 0.6, 0.4, 1.2}; }

/// Rooms in a grid, with doors between neighbours.
class Floor {
 public:
  Floor(int columns, int rows, const Vector2d& room)
      : columns_(columns), rows_(rows), room_(room) {}

  int count() const { return columns_ * rows_; }
  Vector2d Center(int i) const {
    const int row = i / columns_;
    return {(i % columns_ + 0.5) * room_.x(), (row + 0.5) * room_.y()};
  }
  Area All() const { return {{0.0, 0.0}, {columns_ * room_.x(), rows_ * room_.y()}}; }

  struct Door {
    int a, b;  // rooms; b lies to the east or north of a
    Vector2d center, through;
    double width;
  };
  /// Rooms around the edge are joined in a ring, so that a tour needs no turning back.
  void CutDoors(Random* random);
  void Build(double height, world::WorldSpec* world) const;
  const std::vector<Door>& doors() const { return doors_; }

 private:
  void Cut(int a, int b, Random* random);

  int columns_, rows_;
  Vector2d room_;
  std::vector<Door> doors_;
};

void Floor::Cut(int a, int b, Random* random) {
  const Vector2d apart = Center(b) - Center(a), through = apart.normalized();
  const Vector2d along(through.y(), through.x());  // east or north
  const double width = random->Uniform(1.4, 2.0);
  const double span = 0.5 * std::abs(along.dot(room_)) - 0.5 * width - 0.7;
  const Vector2d center = Center(a) + 0.5 * apart + random->Uniform(-span, span) * along;
  doors_.push_back({a, b, center, through, width});
}

void Floor::CutDoors(Random* random) {
  for (int i = 0; i < count(); ++i) {
    const bool edge_row = i / columns_ == 0 || i / columns_ == rows_ - 1;
    const bool edge_column = i % columns_ == 0 || i % columns_ == columns_ - 1;
    if (i % columns_ + 1 < columns_ && (edge_row || Chance(random, 0.5))) Cut(i, i + 1, random);
    if (i / columns_ + 1 < rows_ && (edge_column || Chance(random, 0.5)))
      Cut(i, i + columns_, random);
  }
}

/// Every inner wall as the pieces beside its door, or whole.
void Floor::Build(double height, world::WorldSpec* world) const {
  Enclose(All(), height, world);
  for (int i = 0; i < count(); ++i)
    for (const int next : {i % columns_ + 1 < columns_ ? i + 1 : -1, i + columns_}) {
      if (next < 0 || next >= count()) continue;
      const Vector2d apart = Center(next) - Center(i), middle = Center(i) + 0.5 * apart;
      const Vector2d along(apart.y() / apart.norm(), apart.x() / apart.norm());
      const Vector2d half = 0.5 * std::abs(along.dot(room_)) * along;
      const auto door = std::find_if(doors_.begin(), doors_.end(),
                                     [&](const Door& d) { return d.a == i && d.b == next; });
      if (door == doors_.end()) {
        world->walls.push_back({middle - half, middle + half, height, 0.15});
        continue;
      }
      const Vector2d jamb = 0.5 * door->width * along;
      world->walls.push_back({middle - half, door->center - jamb, height, 0.15});
      world->walls.push_back({door->center + jamb, middle + half, height, 0.15});
    }
}

/// From room to room through doors, straight through each; never back through the same one.
std::vector<Vector2d> RoomTour(const Floor& floor, double length, Random* random) {
  constexpr double kBeforeDoor = 0.8;  // m, so that corners end before the door
  int room = Whole(random, 0, floor.count() - 1), last = -1;
  const auto spot = [&](int i) -> Vector2d {
    return floor.Center(i) + Vector2d(random->Uniform(-0.6, 0.6), random->Uniform(-0.6, 0.6));
  };
  std::vector<Vector2d> way = {spot(room)};
  for (double driven = 0.0; driven < length;) {
    std::vector<const Floor::Door*> choices;
    for (const auto& door : floor.doors()) {
      const int other = door.a == room ? door.b : door.b == room ? door.a : -1;
      if (other >= 0 && other != last) choices.push_back(&door);
    }
    const auto& door =
        *choices[static_cast<std::size_t>(Whole(random, 0, static_cast<int>(choices.size()) - 1))];
    const Vector2d in = (door.a == room ? kBeforeDoor : -kBeforeDoor) * door.through;
    last = room;
    room = door.a == room ? door.b : door.a;
    for (const Vector2d& p : {Vector2d(door.center - in), Vector2d(door.center + in), spot(room)}) {
      driven += (p - way.back()).norm();
      way.push_back(p);
    }
  }
  return way;
}

/// The centre line of a corridor whose turns alternate, so that it never meets itself.
std::vector<Vector2d> CorridorLine(double length, Random* random) {
  std::vector<Vector2d> line = {Vector2d::Zero()};
  bool east = true;
  for (double built = 0.0; built < length; east = !east) {
    const double leg = std::min(random->Uniform(6.0, 14.0), std::max(6.0, length - built));
    line.push_back(line.back() + (east ? Vector2d(leg, 0.0) : Vector2d(0.0, leg)));
    built += leg;
  }
  return line;
}

/// The line moved by `offset` to its left; corners stay square.
std::vector<Vector2d> Beside(const std::vector<Vector2d>& line, double offset) {
  std::vector<Vector2d> out;
  for (std::size_t i = 0; i < line.size(); ++i) {
    Vector2d shift = Vector2d::Zero();
    for (const std::size_t k : {i, i + 1}) {
      if (k == 0 || k >= line.size()) continue;
      const Vector2d d = (line[k] - line[k - 1]).normalized();
      shift += Vector2d(-d.y(), d.x());
    }
    out.push_back(line[i] + offset * shift);
  }
  return out;
}

}  // namespace

std::optional<Scenario> Hall(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(12.0, 20.0), random->Uniform(8.0, 14.0));
  const double height = random->Uniform(3.0, 4.5);
  Scenario scenario;
  Enclose(area, height, &scenario.world);
  const TourPlan plan{1.4, 2.5, random->Uniform(2.0, 2.8), Whole(random, 6, 10)};
  if (!SendAround(area, plan, Indoors(1.2), options, random, &scenario)) return std::nullopt;
  const KeptFree free(scenario, kWayClear);
  Placer placer(area, free, random);
  placer.Boxes(Whole(random, 0, 3), 0.3, {1.0, 0.8, 1.2}, 0.5, false, &scenario);
  placer.Pillars(Whole(random, 5, 12), 0.6, 0.15, 0.4, height - 0.5, &scenario);
  return scenario;
}

std::optional<Scenario> Office(const Options& options, Random* random) {
  Floor floor(Whole(random, 2, 3), 2, {random->Uniform(5.5, 7.5), random->Uniform(5.0, 7.0)});
  floor.CutDoors(random);
  Scenario scenario;
  scenario.duration_s = options.duration;
  floor.Build(random->Uniform(2.6, 3.2), &scenario.world);
  scenario.target = DrawTarget(Indoors(1.0), random);
  scenario.target.corner_radius = random->Uniform(0.3, 0.6);
  const double length = std::max(8.0, scenario.target.speed * options.duration);
  scenario.target.waypoints = RoomTour(floor, length, random);
  AddStops(options.hidden_start, random, &scenario.target);
  const Area area = floor.All();
  if (!PlaceChaser(area, random->Uniform(1.9, 2.3), options.hidden_start, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, kWayClear);
  Placer placer(area, free, random);
  placer.Boxes(Whole(random, 3, 10), 0.2, {1.4, 0.7, 0.75}, 0.1, true, &scenario);  // desks
  placer.Boxes(Whole(random, 2, 6), 0.2, {0.9, 0.45, 1.9}, 0.1, true, &scenario);   // shelves
  return scenario;
}

std::optional<Scenario> Corridor(const Options& options, Random* random) {
  constexpr double kBehind = 4.0, kAhead = 2.0;  // m of corridor before and after the way
  Scenario scenario;
  scenario.duration_s = options.duration;
  scenario.target = DrawTarget(Indoors(1.2), random);
  const double driven = std::max(8.0, scenario.target.speed * options.duration);
  const auto line = CorridorLine(driven + kBehind + kAhead, random);
  const double half = random->Uniform(1.25, 1.7), height = random->Uniform(2.5, 3.5);
  auto& walls = scenario.world.walls;
  const auto left = Beside(line, half + 0.1), right = Beside(line, -half - 0.1);
  for (std::size_t i = 1; i < line.size(); ++i) {
    walls.push_back({left[i - 1], left[i], height, 0.2});
    walls.push_back({right[i - 1], right[i], height, 0.2});
  }
  walls.push_back({left.front(), right.front(), height, 0.2});
  walls.push_back({left.back(), right.back(), height, 0.2});
  auto& way = scenario.target.waypoints;
  way = line;
  way.front() += kBehind * (line[1] - line[0]).normalized();
  way.back() -= kAhead * (line.back() - line[line.size() - 2]).normalized();
  const double sway = half - 1.15;  // m beside the centre line
  for (std::size_t i = 0; i < way.size(); ++i)
    way[i] += Vector2d(random->Uniform(-sway, sway), random->Uniform(-sway, sway));
  AddStops(options.hidden_start, random, &scenario.target);
  const Area first{{0.0, -half}, {line[1].x(), half}};
  if (!PlaceChaser(first, random->Uniform(1.9, 2.4), options.hidden_start, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 0.7);
  for (std::size_t i = 1; i < line.size(); ++i) {  // cupboards and pillars along the walls
    const Vector2d &a = line[i - 1], &b = line[i];
    const Vector2d d = (b - a).normalized(), across(half * d.y(), half * d.x());
    const Area leg{a.cwiseMin(b) - across, a.cwiseMax(b) + across};
    Placer placer(leg, free, random);
    placer.Boxes(Whole(random, 0, 2), 0.5, {0.8, 0.3, 1.8}, 0.2, true, &scenario);
    placer.Pillars(Whole(random, 0, 2), 0.5, 0.1, 0.2, height, &scenario);
  }
  return scenario;
}

}  // namespace chase::worlds
