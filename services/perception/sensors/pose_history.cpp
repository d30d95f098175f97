#include "services/perception/sensors/pose_history.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::perception {

namespace {

constexpr double kMaxGap = 0.15;  // s between samples that are still joined

PoseSample Between(const PoseSample& a, const PoseSample& b, double t) {
  const double s = (t - a.t) / (b.t - a.t);
  PoseSample out = s < 0.5 ? a : b;
  out.t = t;
  out.p_WB = (1.0 - s) * a.p_WB + s * b.p_WB;
  out.v_WB = (1.0 - s) * a.v_WB + s * b.v_WB;
  out.R_WB = a.R_WB.slerp(s, b.R_WB);
  return out;
}

/// `sample` carried to time t, later or earlier, by its velocity, acceleration and rates.
PoseSample Extrapolated(const PoseSample& sample, double t) {
  const double dt = t - sample.t;
  PoseSample out = sample;
  out.t = t;
  out.p_WB += dt * sample.v_WB + 0.5 * dt * dt * sample.a_WB;
  out.v_WB += dt * sample.a_WB;
  out.R_WB = (sample.R_WB * math::ExpSO3(dt * sample.w_WB_B)).normalized();
  return out;
}

}  // namespace

void PoseHistory::Add(const PoseSample& sample) {
  if (!samples_.empty() && sample.t < samples_.back().t - kSpan) samples_.clear();
  if (!samples_.empty() && sample.t <= samples_.back().t) return;
  samples_.push_back(sample);
  while (samples_.front().t < sample.t - kSpan) samples_.pop_front();
}

std::optional<PoseSample> PoseHistory::At(double t, double max_extrapolation) const {
  if (samples_.empty()) return std::nullopt;
  const PoseSample &first = samples_.front(), &last = samples_.back();
  if (t < first.t || t >= last.t) {
    const PoseSample& end = t < first.t ? first : last;
    if (std::abs(t - end.t) > max_extrapolation) return std::nullopt;
    return Extrapolated(end, t);
  }
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), t,
                                      [](double time, const PoseSample& s) { return time < s.t; });
  const auto before = std::prev(after);
  if (after->t - before->t > kMaxGap) return std::nullopt;
  return Between(*before, *after, t);
}

std::optional<PoseSample> PoseHistory::Nearest(double t, double max_age) const {
  const PoseSample* best = nullptr;
  for (const auto& s : samples_)
    if (!best || std::abs(s.t - t) < std::abs(best->t - t)) best = &s;
  if (!best || std::abs(best->t - t) > max_age) return std::nullopt;
  return *best;
}

}  // namespace chase::perception
