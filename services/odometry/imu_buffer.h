#pragma once

#include <deque>

#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

/// The latest inertial samples in order of time, and the filter's motion through them.
class ImuBuffer {
 public:
  /// `longest_gap` s without a sample makes the motion blind.
  ImuBuffer(const FilterConfig& filter, double longest_gap)
      : filter_(filter), longest_gap_(longest_gap) {}

  /// `imu.t` must lie after newest().
  void Add(const ImuSample& imu) { samples_.push_back(imu); }
  bool empty() const { return samples_.empty(); }
  double newest() const { return samples_.empty() ? -1e18 : samples_.back().t; }
  /// Of the samples until t.
  double NewestUntil(double t) const;

  /// Forgets what motion from `t` on does not need.
  void DropBefore(double t);

  /// Advances `state` to time `t` through the samples between; appends what it passes to `track`.
  void Advance(double t, NavState* state, std::vector<NavState>* track = nullptr) const;

 private:
  void Step(double t, NavState* state) const;
  bool Covered(double from, double to) const;
  ImuSample At(double t) const;

  FilterConfig filter_;
  double longest_gap_;
  std::deque<ImuSample> samples_;
};

/// Poses at start, start + step, ... up to the end of `track`, which is in order of time. Before
/// the first state the motion goes on as it was there.
std::vector<Pose> PosesOver(const std::vector<NavState>& track, double start, double step, int n);

}  // namespace chase::odometry
