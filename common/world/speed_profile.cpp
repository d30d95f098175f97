#include "common/world/speed_profile.h"

#include <algorithm>
#include <cmath>

namespace chase::world {
namespace {

/// Speeds at the joints of the stretches that the acceleration allows: a pass from either end.
std::vector<double> JointSpeeds(const std::vector<Stretch>& stretches, double acceleration) {
  const std::size_t n = stretches.size();
  std::vector<double> v(n + 1, 0.0);
  for (std::size_t i = 1; i < n; ++i)
    v[i] =
        stretches[i - 1].rest >= 0.0 ? 0.0 : std::min(stretches[i - 1].speed, stretches[i].speed);
  const auto reachable = [&](double from, double length) {
    return std::sqrt(from * from + 2.0 * acceleration * length);
  };
  for (std::size_t i = 1; i < n; ++i)
    v[i] = std::min(v[i], reachable(v[i - 1], stretches[i - 1].length));
  for (std::size_t i = n; i-- > 1;) v[i] = std::min(v[i], reachable(v[i + 1], stretches[i].length));
  return v;
}

}  // namespace

double SpeedProfile::Ramp::peak() const {
  return std::min(speed, std::sqrt(length * acceleration + 0.5 * (first * first + last * last)));
}

double SpeedProfile::Ramp::duration() const {
  const double v = peak();
  const double less = first + last - 0.5 * (first * first + last * last) / v;
  return length / v + v / acceleration - less / acceleration;
}

double SpeedProfile::Ramp::SpeedAt(double t) const {
  const double up = first + t * acceleration, down = last + (duration() - t) * acceleration;
  return std::clamp(std::min(up, down), 0.0, peak());
}

double SpeedProfile::Ramp::LengthAt(double t) const {
  const double v = peak(), up = (v - first) / acceleration, down = (v - last) / acceleration;
  const double left = duration() - t;
  if (t <= 0.0) return 0.0;
  if (left <= 0.0) return length;
  if (t < up) return first * t + 0.5 * acceleration * t * t;
  if (left < down) return length - (last * left + 0.5 * acceleration * left * left);
  return v * (t - 0.5 * up * (1.0 - first / v));
}

SpeedProfile::SpeedProfile(const std::vector<Stretch>& stretches, double acceleration, double wait)
    : duration_(wait) {
  if (wait > 0.0) rests_.push_back(wait);
  const auto joints = JointSpeeds(stretches, acceleration);
  double length = 0.0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& s = stretches[i];
    ramps_.push_back(
        {duration_, length, s.length, s.speed, acceleration, joints[i], joints[i + 1]});
    length += s.length;
    duration_ += ramps_.back().duration();
    if (s.rest < 0.0 || i + 1 == stretches.size()) continue;
    rests_.push_back(duration_);
    duration_ += s.rest;
    if (s.rest > 0.0) rests_.push_back(duration_);
  }
}

const SpeedProfile::Ramp& SpeedProfile::At(double t) const {
  std::size_t i = 0;
  while (i + 1 < ramps_.size() && t >= ramps_[i + 1].start) ++i;
  return ramps_[i];
}

double SpeedProfile::LengthAt(double t) const {
  const Ramp& ramp = At(t);
  return ramp.from + ramp.LengthAt(t - ramp.start);
}

double SpeedProfile::SpeedAt(double t) const {
  const Ramp& ramp = At(t);
  return ramp.SpeedAt(t - ramp.start);
}

}  // namespace chase::world
