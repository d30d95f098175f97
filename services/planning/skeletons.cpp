#include "services/planning/skeletons.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace chase::planning {
namespace {

constexpr int kMaxCandidates = 4096;  // that adaptation may grow to

// Offset of choice i from the present bearing: 0, then pairs to both sides, ever further apart, up
// to half a turn.
double AzimuthOffset(int i, int choices) {
  if (i == 0) return 0.0;
  const int pairs = choices / 2;
  const double share = static_cast<double>((i + 1) / 2) / std::max(1, pairs);
  const double offset = M_PI * std::pow(share, 1.4) * (choices % 2 ? 1.0 - 0.5 / pairs : 1.0);
  return i % 2 ? offset : -offset;
}

// `v` turned about the vertical; turn: cosine and sine.
Eigen::Vector3d Turned(const Eigen::Vector3d& v, const Eigen::Vector2d& turn) {
  return {turn.x() * v.x() - turn.y() * v.y(), turn.y() * v.x() + turn.x() * v.y(), v.z()};
}

Eigen::Vector2d TurnBy(double angle) { return {std::cos(angle), std::sin(angle)}; }

// The obstacles at one time, as far as they are asked to be clear of.
class Moment {
 public:
  Moment(const Problem& problem, double tau, const Eigen::Vector3d& target)
      : problem_(problem), target_(target) {
    centers_.reserve(problem.obstacles.size());
    for (const Ellipsoid& e : problem.obstacles) centers_.push_back(Evaluate(e.center, tau));
  }

  bool IsFree(const Eigen::Vector3d& u) {
    // What was in the way last time is likely to be again.
    if (!centers_.empty() && !IsClearOf(last_, u)) return false;
    for (size_t j = 0; j < centers_.size(); ++j)
      if (j != last_ && !IsClearOf(j, u)) {
        last_ = j;
        return false;
      }
    return true;
  }

 private:
  bool IsClearOf(size_t j, const Eigen::Vector3d& u) const {
    constexpr double kClear = 1.05;
    const Ellipsoid& e = problem_.obstacles[j];
    const Eigen::Vector3d d = u - centers_[j];
    if (d.dot(e.safety * d) < kClear) return false;
    return e.sight_from >= kNoSight ||
           world::SegmentSquaredDistance(u, target_, centers_[j], e.sight) >= kClear;
  }

  const Problem& problem_;
  const Eigen::Vector3d target_;
  std::vector<Eigen::Vector3d> centers_;
  size_t last_ = 0;
};

// `first`, or the nearest free place around the target q that small changes of it reach.
Eigen::Vector3d Slid(Moment* moment, const Eigen::Vector3d& q, const Eigen::Vector3d& first,
                     double radius, const Eigen::Vector3d& direction) {
  if (moment->IsFree(first)) return first;
  for (double turn : {0.0, 0.15, -0.15, 0.3, -0.3, 0.45, -0.45}) {
    const Eigen::Vector3d turned = Turned(direction, TurnBy(turn));
    for (double r : {1.0, 0.75, 1.3}) {
      const Eigen::Vector3d u = q + r * radius * turned;
      if (moment->IsFree(u)) return u;
    }
  }
  return first;
}

// Obstacles whose centre comes within reach of the ring around the target.
int Clutter(const PlannerConfig& config, const Problem& problem) {
  int n = 0;
  for (const Ellipsoid& e : problem.obstacles) {
    double nearest = HUGE_VAL;
    for (double tau : {0.0, 0.5, 1.0}) {
      const Eigen::Vector3d d = Evaluate(e.center, tau) - Evaluate(problem.target, tau);
      nearest = std::min(nearest, d.head<2>().norm());
    }
    n += nearest < 1.3 * config.desired_distance;
  }
  return n;
}

// Of the drone from the target, cosine and sine.
Eigen::Vector2d Bearing(const Problem& problem) {
  const Eigen::Vector2d r = (problem.start.row(0) - problem.target.row(0)).head<2>().transpose();
  if (r.norm() > 1e-3) return r.normalized();
  const Eigen::Vector2d v = Evaluate(problem.target, 0.0, 1).head<2>();  // on top: get behind it
  return v.norm() > 1e-9 ? Eigen::Vector2d(-v.normalized()) : Eigen::Vector2d(1.0, 0.0);
}

// Radii at tau are this much larger than wanted: from the present distance to the desired one at a
// speed that leaves room below the limit.
double RadiusScale(const PlannerConfig& config, const Problem& problem, double tau) {
  constexpr double kStartsAfter = 0.5;  // s, to gather speed
  const double distance =
      (Evaluate(problem.start, 0.0) - Evaluate(problem.target, 0.0)).head<2>().norm();
  const double target_speed = Evaluate(problem.target, tau, 1).norm() / problem.duration;
  const double fastest = config.max_speed > 0.0 ? 0.6 * config.max_speed : 3.0;
  const double closing = std::max(0.4, fastest - target_speed);
  const double moved = closing * std::max(0.0, tau * problem.duration - kStartsAfter);
  const double want = config.desired_distance;
  const double radius =
      distance > want ? std::max(want, distance - moved) : std::min(want, distance + moved);
  return std::abs(radius - want) < 0.3 * want ? 1.0 : std::max(0.4, radius / want);
}

void AddNearDrone(Problem* problem) {
  const Eigen::Vector3d p = Evaluate(problem->start, 0.0);
  const Eigen::Vector3d v = Evaluate(problem->start, 0.0, 1) / problem->duration;
  const Eigen::Vector3d stop = p + 0.3 * v;
  for (size_t n = 0; n < problem->skeletons.size(); ++n) {
    const double reach = 0.4 * static_cast<double>(n + 1);
    problem->skeletons[n].push_back(stop);
    for (int k = 0; k < 4; ++k)
      problem->skeletons[n].push_back(
          stop + reach * Eigen::Vector3d(std::cos(0.5 * M_PI * k), std::sin(0.5 * M_PI * k), 0.0));
  }
}

SkeletonPlacer::Spread NormalSpread(const PlannerConfig& c) {
  const double deg = M_PI / 180.0;
  return {(1.0 - c.radius_spread) * c.desired_distance,
          (1.0 + c.radius_spread) * c.desired_distance, c.elevation_low_deg * deg,
          c.elevation_high_deg * deg};
}

int AffordableChoices(int wanted, int steps) {
  while (wanted > 1 && std::pow(wanted, steps) > kMaxCandidates) --wanted;
  return wanted;
}

}  // namespace

const std::vector<Eigen::Vector2d>& SkeletonPlacer::TurnsOf(int choices) {
  if (turns_.size() <= static_cast<size_t>(choices))
    turns_.resize(static_cast<size_t>(choices) + 1);
  auto& turns = turns_[static_cast<size_t>(choices)];
  for (int i = static_cast<int>(turns.size()); i < choices; ++i)
    turns.push_back(TurnBy(AzimuthOffset(i, choices)));
  return turns;
}

void SkeletonPlacer::PlaceAt(int steps, int choices, const Spread& spread, bool slide,
                             Problem* problem) {
  const Eigen::Vector2d bearing = Bearing(*problem);
  const std::vector<Eigen::Vector2d>& turns = TurnsOf(choices);
  const Eigen::Vector2d low = TurnBy(spread.low), high = TurnBy(spread.high);
  problem->skeletons.resize(static_cast<size_t>(steps));
  for (int n = 1; n <= steps; ++n) {
    const double tau = static_cast<double>(n) / steps;
    const double scale = slide ? RadiusScale(config_, *problem, tau) : 1.0;
    const Eigen::Vector3d q = Evaluate(problem->target, tau);
    std::optional<Moment> moment;
    if (slide) moment.emplace(*problem, tau, q);
    auto& at = problem->skeletons[static_cast<size_t>(n - 1)];
    at.clear();
    at.reserve(static_cast<size_t>(choices));
    for (int i = 0; i < choices; ++i) {
      const double radius = scale * ((i + n) % 2 ? spread.radius_near : spread.radius_far);
      const Eigen::Vector2d& elevation = (i / 2 + n) % 2 ? low : high;
      const Eigen::Vector3d level(elevation.x() * bearing.x(), elevation.x() * bearing.y(),
                                  elevation.y());
      const Eigen::Vector3d direction = Turned(level, turns[static_cast<size_t>(i)]);
      const Eigen::Vector3d u = q + radius * direction;
      at.push_back(slide ? Slid(&*moment, q, u, radius, direction) : u);
    }
  }
  if (!(config_.z_max > config_.z_min)) return;
  const double lowest = std::clamp(problem->limits.z_min, config_.z_min, config_.z_max);
  for (auto& choices_at : problem->skeletons)
    for (auto& u : choices_at) {
      const double z = problem->limits.ground.Above(u);
      u.z() += std::clamp(z, lowest, config_.z_max) - z;
    }
}

void SkeletonPlacer::PlaceRing(int steps, int choices, Problem* problem) {
  PlaceAt(steps, choices, NormalSpread(config_), false, problem);
}

void SkeletonPlacer::Place(Layout layout, Problem* problem) {
  Spread spread = NormalSpread(config_);
  const int few = std::min(config_.steps, 3);
  if (layout == Layout::kWide) {
    spread.radius_near *= 0.7;
    spread.radius_far *= 1.35;
    spread.high *= 1.6;
    PlaceAt(few, AffordableChoices(2 * config_.skeletons, few), spread, true, problem);
  } else if (layout == Layout::kCautious) {
    PlaceAt(few, 7, spread, true, problem);
    AddNearDrone(problem);
  } else if (!config_.adaptive) {
    PlaceRing(config_.steps, config_.skeletons, problem);
  } else {
    const int extra = std::min(3, Clutter(config_, *problem) / 2);
    const int choices =
        std::max(config_.skeletons, AffordableChoices(config_.skeletons + extra, config_.steps));
    PlaceAt(config_.steps, choices, spread, true, problem);
  }
}

}  // namespace chase::planning
