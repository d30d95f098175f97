#pragma once

#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "common/world/obstacle.h"
#include "mapping_world.h"

namespace chase::mapping::testing {

/// True surface points that returns came from, counted in cells of 5 cm.
class HitCounter {
 public:
  void Add(const Truth& truth);
  /// Share of points hit at least three times, of upright objects within the flight volume
  /// (0.35 to 2.9 m) and `radius` m of `at` in plan, that some obstacle holds at time t.
  double Coverage(const std::vector<world::Obstacle>& obstacles, const Eigen::Vector3d& at,
                  double radius, double t, int* points = nullptr) const;

 private:
  struct Entry {
    int count = 0;
    Eigen::Vector3d point;
  };
  std::map<std::tuple<int, int, int>, Entry> entries_;
};

/// True if p lies inside a box or cylinder of the world.
bool Solid(const World& world, const Eigen::Vector3d& p);

/// Share of the free volume, z 0.5 to 2.5 m, in the box low..high that obstacles block at time t.
double Blocked(const World& world, const std::vector<world::Obstacle>& obstacles,
               const Eigen::Vector2d& low, const Eigen::Vector2d& high, double t);

/// Larger semi-axis of an obstacle's horizontal section at height z, m; 0 where there is none.
double SectionRadius(const world::Obstacle& obstacle, double z);

/// The obstacle that holds p at time t, or null.
const world::Obstacle* Holding(const std::vector<world::Obstacle>& obstacles,
                               const Eigen::Vector3d& p, double t);

}  // namespace chase::mapping::testing
