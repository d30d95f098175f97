#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/planning/stopping.h"

namespace chase::planning {

/// The way that the body came, without its loops: where it flew was room for it. Frame W.
class Trail {
 public:
  /// The body is at p_WB = `p` [m].
  void Add(const Eigen::Vector3d& p);
  void Clear() { points_.clear(); }

  /// A spacing apart, the oldest first.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  static constexpr double kSpacing = 0.5;       // m: twice a body's radius
  static constexpr std::size_t kMost = 10'000;  // 5 km
  std::vector<Eigen::Vector3d> points_;
};

/// Back to where it took off, leg by leg: straight where that can be certified, else along the
/// trail. A trail that begins elsewhere, as that of a process started in flight, is led straight
/// on.
class WayBack {
 public:
  /// The next leg from the request's start, or what is left of the one being flown, if `flown` is
  /// that; nothing where none can be certified and `may_fly`. It ends at rest, at `home` in the
  /// end.
  std::optional<Stop> Leg(const PlannerConfig& config, const PlanRequest& request,
                          const Trail& trail, const Eigen::Vector3d& home,
                          const world::Trajectory* flown, const MayFly& may_fly);
  /// Another task: the next leg is a first one.
  void Reset() { goal_.reset(); }

 private:
  std::optional<std::size_t> goal_;  // of the leg being flown, by its place on the way; 0: home
};

}  // namespace chase::planning
