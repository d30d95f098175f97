#pragma once

#include <optional>
#include <set>
#include <vector>

#include "services/mapping/mapper.h"
#include "stage.h"

namespace chase::mapping_stage {

/// How often something held, of how many.
struct Share {
  long held = 0, all = 0;
  void Add(bool holds) { held += holds, ++all; }
  void Add(const Share& other) { held += other.held, all += other.all; }
};

/// Figures of walkers within 6 m of the drone, pooled over flights.
struct WalkerFigures {
  Share listed;    ///< sweeps in view, from 1 s after it was first in view and walked
  Share any_time;  ///< the same from the first such sweep on
  Share held;      ///< sweeps in view, walking or standing, with what is seen of it in any obstacle
  Share fast;      ///< velocity error of at most 0.3 m/s, from 0.3 s after each change of velocity
  Share slim;      ///< longest semi-axis at most 0.3 m more than the true one
  Share one_id;    ///< sightings with one id
  Share reversed;  ///< velocity error of at most 0.3 m/s within 0.3 s of a change of direction
  Share halved;    ///< the same, nearer to the new velocity than to the old one
  Share stopped;  ///< as `reversed`, of other changes: stops, starts and turns by less than 120 deg
  Share beside;   ///< passages beside the target with no gap above 0.2 s
  Share hidden;   ///< times out of view, below 2 s, with no gap above 0.2 s
  Share blind;    ///< those of them that the sensor's blind range caused
  Share velocity_honest, center_honest;  ///< errors within the published 95 %, in view
  std::vector<double> velocity, axis;    ///< errors, m/s and m
  std::vector<double> acquired;          ///< s from first in view to first listed
  std::vector<double> bare;              ///< s in view without being held, one after the other
  long phantoms = 0, sweeps = 0;         ///< sweeps that list a mover farther than 1 m from any
  long target_blocked = 0;               ///< sweeps with the target's centre inside a mover
  std::vector<double> ms;                ///< of a sweep

  void Add(const WalkerFigures& other);
};

/// Judges what is listed of walkers against the truth. A listed mover stands for the nearest walker
/// within 0.5 m and two published deviations, a walker for one listed mover. A walker that stood
/// for two seconds is a static obstacle by definition and is judged anew when it walks.
class WalkerJudge {
 public:
  explicit WalkerJudge(bool trace) : trace_(trace) {}
  void Add(const Shot& shot, const mapping::ObstacleList& list);
  /// Call after the last sweep.
  void Close();
  WalkerFigures figures;

 private:
  /// An interval in which a walker is hidden or beside the target.
  struct Spell {
    bool open = false, was_listed = false, over = false;
    double from = 0.0, until = 0.0, listed = 0.0, gap = 0.0;  ///< s; longest time unlisted
  };
  struct Walker {
    double began = -1.0;      ///< s, when it was first in view while it walked; below 0: not yet
    double in_view = -1e9;    ///< s, last in view, at any range
    double walked = -1e9;     ///< s, last time not at rest
    double listed = -1.0;     ///< s, first listed since it began
    bool was_listed = false;  ///< in the sweep before
    bool seen_near = false;   ///< within 6 m since it began
    double bare = 0.0;        ///< s in view within 6 m without being held, until now
    std::set<int> ids;        ///< in view within 6 m, since it began
    Eigen::Vector2d v = Eigen::Vector2d::Zero(), before = Eigen::Vector2d::Zero();
    double changed = -1e9;  ///< s, of the last change of velocity
    bool open_change = false, followed = false, half = false;
    Spell beside, hidden, blind;
  };

  std::vector<const world::Obstacle*> Match(const Shot& shot, const mapping::ObstacleList& list);
  void Follow(const Shot& shot, size_t k, int hits, const world::Obstacle* o);
  void JudgeHeld(const Shot& shot, const mapping::ObstacleList& list, size_t k);
  void JudgeMotion(double t, const world::MoverState& truth, const world::Obstacle& o, Walker* w);
  void JudgeChange(double t, const world::MoverState& truth, const world::Obstacle* o, bool judged,
                   Walker* w);
  static void Step(double t, bool inside, bool listed, bool listed_before, double slack,
                   Spell* spell);
  void Close(Spell* spell, const char* name, double longest, Share* share) const;
  void EndSighting(Walker* w);

  bool trace_;
  std::vector<Walker> walkers_;
};

/// The world `file` with the drone on the target's own way, the scenario's distance behind it.
Course Behind(const world::Scenario& scenario);

}  // namespace chase::mapping_stage
