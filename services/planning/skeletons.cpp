#include "services/planning/skeletons.h"

#include <algorithm>
#include <cmath>

namespace chase::planning {
namespace {

constexpr int kMaxCandidates = 4096;  // that adaptation may grow to

struct Spread {
  double radius_near, radius_far;  // m
  double low, high;                // elevations, rad
};

struct Direction {
  double azimuth, elevation;  // rad
  Eigen::Vector3d unit;

  Direction(double azimuth_, double elevation_)
      : azimuth(azimuth_),
        elevation(elevation_),
        unit(std::cos(azimuth_) * std::cos(elevation_), std::sin(azimuth_) * std::cos(elevation_),
             std::sin(elevation_)) {}
};

// Offset of choice i from the present bearing: 0, then pairs to both sides, ever further apart, up
// to half a turn.
double AzimuthOffset(int i, int choices) {
  if (i == 0) return 0.0;
  const int pairs = choices / 2;
  const double share = static_cast<double>((i + 1) / 2) / std::max(1, pairs);
  const double offset = M_PI * std::pow(share, 1.4) * (choices % 2 ? 1.0 - 0.5 / pairs : 1.0);
  return i % 2 ? offset : -offset;
}

bool IsFree(const Problem& problem, double tau, const Eigen::Vector3d& q,
            const Eigen::Vector3d& u) {
  for (const Ellipsoid& e : problem.obstacles) {
    const Eigen::Vector3d c = Evaluate(e.center, tau);
    if ((u - c).dot(e.safety * (u - c)) < 1.05) return false;
    if (e.sight_from < 1.0 && world::SegmentSquaredDistance(u, q, c, e.sight) < 1.05) return false;
  }
  return true;
}

// `first`, or the nearest free place around the target q that small changes of it reach.
Eigen::Vector3d Slid(const Problem& problem, double tau, const Eigen::Vector3d& q,
                     const Eigen::Vector3d& first, double radius, const Direction& d) {
  if (IsFree(problem, tau, q, first)) return first;
  for (double turn : {0.0, 0.15, -0.15, 0.3, -0.3, 0.45, -0.45}) {
    const Direction turned(d.azimuth + turn, d.elevation);
    for (double r : {1.0, 0.75, 1.3}) {
      const Eigen::Vector3d u = q + r * radius * turned.unit;
      if (IsFree(problem, tau, q, u)) return u;
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

double Bearing(const Problem& problem) {
  const Eigen::Vector3d r = Evaluate(problem.start, 0.0) - Evaluate(problem.target, 0.0);
  if (r.head<2>().norm() > 1e-3) return std::atan2(r.y(), r.x());
  const Eigen::Vector3d v = Evaluate(problem.target, 0.0, 1);  // on top of it: get behind it
  return std::atan2(-v.y(), -v.x());
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

void Place(const PlannerConfig& config, int steps, int choices, const Spread& spread, bool slide,
           Problem* problem) {
  const double bearing = Bearing(*problem);
  problem->skeletons.assign(static_cast<size_t>(steps), {});
  std::vector<Direction> directions;  // [choice][low, high]
  for (int i = 0; i < choices; ++i)
    for (double elevation : {spread.low, spread.high})
      directions.emplace_back(bearing + AzimuthOffset(i, choices), elevation);
  for (int n = 1; n <= steps; ++n) {
    const double tau = static_cast<double>(n) / steps;
    const double scale = slide ? RadiusScale(config, *problem, tau) : 1.0;
    const Eigen::Vector3d q = Evaluate(problem->target, tau);
    auto& at = problem->skeletons[static_cast<size_t>(n - 1)];
    at.reserve(static_cast<size_t>(choices));
    for (int i = 0; i < choices; ++i) {
      const double radius = scale * ((i + n) % 2 ? spread.radius_near : spread.radius_far);
      const Direction& d = directions[static_cast<size_t>(2 * i + ((i / 2 + n) % 2 ? 0 : 1))];
      const Eigen::Vector3d u = q + radius * d.unit;
      at.push_back(slide ? Slid(*problem, tau, q, u, radius, d) : u);
    }
  }
  if (!(config.z_max > config.z_min)) return;
  for (auto& choices_at : problem->skeletons)
    for (auto& u : choices_at) u.z() = std::clamp(u.z(), config.z_min, config.z_max);
}

Spread NormalSpread(const PlannerConfig& c) {
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

void PlaceRing(const PlannerConfig& config, int steps, int choices, Problem* problem) {
  Place(config, steps, choices, NormalSpread(config), false, problem);
}

void PlaceSkeletons(const PlannerConfig& config, Layout layout, Problem* problem) {
  if (layout == Layout::kWide) {
    Spread spread = NormalSpread(config);
    spread.radius_near *= 0.7;
    spread.radius_far *= 1.35;
    spread.high *= 1.6;
    const int steps = std::min(config.steps, 3);
    Place(config, steps, AffordableChoices(2 * config.skeletons, steps), spread, true, problem);
    return;
  }
  if (layout == Layout::kCautious) {
    const int steps = std::min(config.steps, 3);
    Place(config, steps, 7, NormalSpread(config), true, problem);
    return AddNearDrone(problem);
  }
  if (!config.adaptive) return PlaceRing(config, config.steps, config.skeletons, problem);
  const int extra = std::min(3, Clutter(config, *problem) / 2);
  const int choices =
      std::max(config.skeletons, AffordableChoices(config.skeletons + extra, config.steps));
  Place(config, config.steps, choices, NormalSpread(config), true, problem);
}

}  // namespace chase::planning
