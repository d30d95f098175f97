#include "services/planning/target_search.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/world/ages.h"

namespace chase::planning {
namespace {

// Looked for from here while that share of where it may be is in sight from here; else a place is
// gone to, for so long, s.
constexpr double kEnoughInSight = 0.5, kKeepsPlace = 1.0;
// Gone to while looking that way: a place so far from the gaze, rad, and from here, desired
// distances.
constexpr double kAhead = 0.5, kArrived = 1.5;
// Deviation of a target that is in sight, m, and how much more it is from one forecast to the next.
constexpr double kKnown = 0.1, kAsKnown = 1.3;
constexpr double kPeriod = 0.25;  // s: forecasts are renewed more often

}  // namespace

// The covariance grows while the target is hidden: such a forecast is no sighting. There are none
// after `target_unseen`, counted from a sighting up to a forecast's period after the last of them.
void TargetSearch::Saw(const Forecast& forecast) {
  const double sigma = math::LargestSigma(forecast.covariance);
  const bool late = forecast.t > last_seen_.start + world::kMostAge.target_unseen + kPeriod;
  if (!has_seen_ || late || sigma <= std::max(kKnown, kAsKnown * last_seen_sigma_)) {
    last_seen_ = forecast.target;
    last_seen_sigma_ = sigma;
    fastest_ = std::max(fastest_, last_seen_.Velocity(last_seen_.start).norm());
  }
  has_seen_ = true;
  whereabouts_.Clear();
}

void TargetSearch::Clear() {
  has_seen_ = false;
  whereabouts_.Clear();
}

// From here as long as enough of where it may be is in sight from here, unless what is worth
// looking at is far ahead; else from where most is.
TargetSearch::Lead TargetSearch::Advance(double t, const std::vector<world::Obstacle>& obstacles,
                                         const BodyEstimate& body, const Eigen::Vector3d& start,
                                         double yaw) {
  const View view = config_.planner.view().value_or(View{});
  if (!whereabouts_.begun()) {
    const double known = last_seen_.start;
    whereabouts_.Begin(known, last_seen_.Position(known), last_seen_.Velocity(known), fastest_);
    place_chosen_ = -1e9;
  }
  whereabouts_.Advance(t, obstacles, body.p, body.yaw, view);
  const auto gaze = whereabouts_.BestGaze(yaw, config_.search_yaw_rate, view);
  if (t - place_chosen_ > kKeepsPlace) {
    place_ = whereabouts_.Likeliest(0.5 * config_.planner.desired_distance);
    place_chosen_ = t;
  }
  const Eigen::Vector2d way = (place_ - start).head<2>();
  const double off = std::remainder(std::atan2(way.y(), way.x()) - gaze.yaw, 2.0 * M_PI);
  const bool ahead =
      std::abs(off) < kAhead && way.norm() > kArrived * config_.planner.desired_distance;
  if (gaze.share > kEnoughInSight && !ahead) return {gaze.yaw, std::nullopt};
  return {gaze.yaw, place_};
}

}  // namespace chase::planning
