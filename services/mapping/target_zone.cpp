#include "services/mapping/target_zone.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr double kSlowDown = 1.0;    // s, time constant with which an unseen target is led
constexpr double kMostSigma = 0.15;  // m, of the estimate that widens the zone
constexpr double kSpread = 0.15;     // m/s, growth of the zone while unseen
constexpr double kMostSpread = 0.3;  // m
constexpr double kInView = 0.3;      // s, age of an estimate of it as seen; six frames
constexpr double kArrival = 1.0;     // s, after the first sighting
constexpr double kHalfSweep = 0.05;  // s; returns were fired up to a sweep before its time

}  // namespace

void TargetZone::Observe(const TargetEstimate& estimate) {
  if (seen_ && estimate.t < last_.t) return;
  if (!seen_ && !estimate.seen) return;
  if (!seen_) first_seen_ = estimate.t;
  if (estimate.seen) last_seen_ = estimate.t;
  last_ = estimate;
  seen_ = true;
}

void TargetZone::MoveTo(double t) {
  const double age = t - last_.t;
  active_ = seen_ && t - last_seen_ <= config_.hold && age >= -config_.hold;
  in_view_ = active_ && last_.seen && age <= kInView;
  if (!active_) return;
  const double lead = age > 0.0 ? kSlowDown * (1.0 - std::exp(-age / kSlowDown)) : age;
  center_ = last_.mean.head<2>() + (lead - kHalfSweep) * last_.velocity.head<2>();
  const double moved = kHalfSweep * last_.velocity.head<2>().norm();
  const double spread = std::clamp(kSpread * (age - 0.2), 0.0, kMostSpread);
  const double sigma = std::min(kMostSigma, last_.sigma);
  outer_ = last_.radius + config_.margin + 2.0 * sigma + spread + moved;
  // What settled here before the target was recognised was the target; what stands where it is only
  // believed to be may be a wall.
  core_ = t - first_seen_ < kArrival ? outer_ : last_.radius + config_.core + moved;
  if (!in_view_) core_ = 0.0;
  top_ = last_.mean.z() + 0.5 * last_.height + config_.margin;
}

}  // namespace chase::mapping
