#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/scenario.h"
#include "deploy/worlds/draw.h"

namespace chase::worlds {

/// A rectangle in plan, frame W, m.
struct Area {
  Eigen::Vector2d min, max;

  bool Contains(const Eigen::Vector2d& p, double margin) const;
  Eigen::Vector2d Point(Random* random, double margin) const;
};

/// About the origin.
Area Centred(double length, double width);

/// Walls around an area, their inner faces on its edges.
void Enclose(const Area& area, double height, world::WorldSpec* world);

/// Places that nothing may stand near to: the target's way, the chaser's start, the line of sight
/// between them at the start. What walls fill is taken as well.
class KeptFree {
 public:
  /// `clearance`: free distance in plan to the target's way, m.
  KeptFree(const world::Scenario& scenario, double clearance);

  /// A random place as far from the target's way as a solid of this radius must be, or up to 1 m
  /// farther.
  Eigen::Vector2d Beside(double radius, Random* random) const;
  /// True when the solid leaves all places free; its height does not matter.
  bool Allows(const world::Solid& solid) const;

 private:
  struct Place {
    Eigen::Vector2d p;
    double distance;
  };
  std::vector<Place> places_;  // those of the way first
  std::size_t on_way_ = 0;
};

/// Random places of solids that leave `free` free and keep a gap to each other; half of them stand
/// beside the target's way, where they matter.
class Placer {
 public:
  Placer(const Area& area, const KeptFree& free, Random* random)
      : area_(area), free_(free), random_(random) {}

  // Up to `count` of each; fewer where there is no more room. Sizes in m.
  void Trees(int count, double gap, world::Scenario* scenario);
  void Pillars(int count, double gap, double radius_min, double radius_max, double height,
               world::Scenario* scenario);
  /// Boxes of about this size that stand on the ground; `square` ones along the axes.
  void Boxes(int count, double gap, const Eigen::Vector3d& size, double variation, bool square,
             world::Scenario* scenario);
  void Boulders(int count, double gap, world::Scenario* scenario);
  /// Tries one solid: takes the place when it is free.
  bool Take(const world::Solid& solid, double gap);

 private:
  Eigen::Vector2d Spot(double radius, double margin);

  struct Taken {
    Eigen::Vector2d center;
    double radius;  // around its footprint, m
  };
  const Area area_;
  const KeptFree& free_;
  Random* random_;
  std::vector<Taken> taken_;
};

}  // namespace chase::worlds
