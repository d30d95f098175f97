#pragma once

#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "logs/src/flight_record.h"

namespace chase::logs {

/// What one truth sample of the mission scores.
struct SampleScore {
  double t = 0.0;          ///< mission time, s
  double distance = 0.0;   ///< |p_WB - p_WT|, m
  double clearance = 0.0;  ///< from the drone's sphere to the nearest solid, m; negative: touching
  bool visible = false;    ///< the segment from drone to target's centre touches no obstacle
  bool done = false;       ///< it has landed: a touch is no collision of the flight

  bool Safe() const { return done || clearance > 0.0; }
};

/// Scores samples against the scenario's own solids; the ground (except where the flight may stand)
/// and the target's body count for clearance, not for sight.
class Scorer {
 public:
  explicit Scorer(const world::Scenario& scenario);

  SampleScore operator()(const TruthSample& sample) const;

  /// What the drone is nearest to: "cylinder at (3.1, 4.0)", "mover 2" (the scenario's second),
  /// "ground" or "target".
  std::string Nearest(const TruthSample& sample) const;

 private:
  /// A solid with the radius of a sphere that encloses it, so that distant ones cost nothing.
  struct Bounded {
    explicit Bounded(const world::Solid& s) : solid(s), radius(s.half_size.norm()) {}
    world::Solid solid;
    double radius;
  };

  double ToGround(const TruthSample& sample) const;
  double ToTarget(const TruthSample& sample) const;
  double Clearance(const TruthSample& sample, const std::vector<world::Solid>& movers) const;
  bool Visible(const TruthSample& sample, const std::vector<world::Solid>& movers) const;

  world::Scenario scenario_;
  std::vector<Bounded> solids_;
};

}  // namespace chase::logs
