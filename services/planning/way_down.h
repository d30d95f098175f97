#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "services/planning/stopping.h"

namespace chase::planning {

/// What a body has to have below it to come down.
struct LandingNeeds {
  double radius = 0.55;     ///< of the disc of ground and of the column above it, m
  double most_slope = 0.2;  ///< rise from the disc's middle, over the radius at most
  double reach = 6.0;       ///< how far aside it is looked for, m
};

/// What lies below a place, worst first.
enum class Footing {
  kTaken,    ///< an obstacle
  kUneven,   ///< ground that slopes, or has a step
  kUnknown,  ///< ground of which nothing is listed
  kLevel,    ///< and nothing stands on it
};

/// Height of the listed ground at (x, y), the highest where several slabs tell of it, frame W, m;
/// nothing where none does.
std::optional<double> GroundAt(const std::vector<world::Obstacle>& obstacles,
                               const Eigen::Vector2d& xy);

/// What a body comes down to straight from p_WB = `p` [m].
Footing FootingAt(const std::vector<world::Obstacle>& obstacles, const LandingNeeds& needs,
                  const Eigen::Vector3d& p);

/// To above the place where it comes down.
class WayDown {
 public:
  /// What is flown, and why there; without a leg it comes down where it is.
  struct Answer {
    std::optional<Stop> leg;
    std::string reason;
  };
  /// The leg, from the request's start, to above the nearest level ground that can be flown to
  /// straight and certified; none where `rest`, at which braking ends, is above such ground, or
  /// where no better is known: then the reason says so. Where it took off, `home` (p_WB), the
  /// ground has borne it. Where none is level, a place that is not taken does. `flown` is the
  /// running plan, if the start lies on it. Legs are such as `may_fly`. Frame W.
  Answer Lead(const PlannerConfig& config, const PlanRequest& request, const LandingNeeds& needs,
              const Eigen::Vector3d& rest, const std::optional<Eigen::Vector3d>& home,
              const world::Trajectory* flown, const MayFly& may_fly);
  /// Another task: the next place is a first one.
  void Reset() { spot_.reset(); }

 private:
  std::optional<Eigen::Vector3d> spot_;  // p_WB above it, frame W, m
};

}  // namespace chase::planning
