#include "services/odometry/imu_buffer.h"

#include <algorithm>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

bool EarlierThan(double t, const ImuSample& imu) { return t < imu.t; }

}  // namespace

void ImuBuffer::DropBefore(double t) {
  while (samples_.size() > 1 && samples_[1].t <= t) samples_.pop_front();
}

double ImuBuffer::NewestUntil(double t) const {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), t, EarlierThan);
  return after == samples_.begin() ? -1e18 : (after - 1)->t;
}

ImuSample ImuBuffer::At(double t) const {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), t, EarlierThan);
  if (after == samples_.begin()) return samples_.front();
  if (after == samples_.end()) return samples_.back();
  const ImuSample& a = *(after - 1);
  const double s = (t - a.t) / (after->t - a.t);
  return {t, a.accel + s * (after->accel - a.accel), a.gyro + s * (after->gyro - a.gyro)};
}

bool ImuBuffer::Covered(double from, double to) const {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), from, EarlierThan);
  const double next = after == samples_.end() ? to : after->t;
  const double previous = after == samples_.begin() ? from : (after - 1)->t;
  return !samples_.empty() && next - previous <= longest_gap_;
}

void ImuBuffer::Step(double t, NavState* state) const {
  if (!Covered(state->t, t)) return PropagateBlind(filter_, t, state);
  const ImuSample a = At(state->t), b = At(t);
  const double dt = t - state->t;
  Propagate(filter_, {t, 0.5 * (a.accel + b.accel), 0.5 * (a.gyro + b.gyro)}, state);
  AddUnsampled(filter_, a, b, dt, state);
}

void ImuBuffer::Advance(double t, NavState* state, std::vector<NavState>* track) const {
  auto next = std::upper_bound(samples_.begin(), samples_.end(), state->t, EarlierThan);
  for (; next != samples_.end() && next->t < t; ++next) {
    Step(next->t, state);
    if (track) track->push_back(*state);
  }
  if (state->t < t) Step(t, state);
  if (track) track->push_back(*state);
}

std::vector<Pose> PosesOver(const std::vector<NavState>& track, double start, double step, int n) {
  std::vector<Pose> poses;
  size_t i = 0;
  for (int k = 0; k < n; ++k) {
    const double t = start + k * step;
    while (i + 2 < track.size() && track[i + 1].t < t) ++i;
    const NavState& a = track[i];
    const double dt = t - a.t;
    if (i + 1 >= track.size() || dt <= 0.0) {
      poses.push_back({(a.R_WB * math::ExpSO3(dt * a.w_B)).normalized(), a.p + dt * a.v});
      continue;
    }
    const NavState& b = track[i + 1];
    const double s = std::min(1.0, dt / std::max(b.t - a.t, 1e-9));
    poses.push_back({a.R_WB.slerp(s, b.R_WB), a.p + s * (b.p - a.p)});
  }
  return poses;
}

}  // namespace chase::odometry
