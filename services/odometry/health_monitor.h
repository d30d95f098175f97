#pragma once

#include <string>

#include "common/world/ages.h"
#include "services/odometry/scan_matcher.h"

namespace chase::odometry {

struct HealthConfig {
  double degraded_after = world::kMostAge.sweeps;  ///< since the last good sweep, s
  double imu_gap = 0.05;                           ///< s
  double late_sweep = 0.045;   ///< a sweep that ends this long away from the newest sample, s
  double lost_sigma = 0.5;     ///< standard deviation of the position without sweeps, m
  double lost_speed = 0.5;     ///< standard deviation of the velocity, m/s
  double usual_nis = 4.0;      ///< running mean, per direction
  double dropped_share = 0.2;  ///< of the usual number of returns

  template <class V>
  void Visit(V& v) {
    v("degraded_after", degraded_after, "since the last good sweep, s");
    v("imu_gap", imu_gap, "longest silence of the IMU, s");
    v("late_sweep", late_sweep, "a sweep's end may lie this far from the newest IMU sample, s");
    v("lost_sigma", lost_sigma, "standard deviation of the position while no sweep helps, m");
    v("lost_speed", lost_speed, "standard deviation of the velocity, m/s");
    v("usual_nis", usual_nis, "running mean of normalised innovations squared, per direction");
    v("dropped_share", dropped_share, "of the usual number of returns");
  }
};

enum class Health { kOk, kDegraded, kLost, kStarting };  // as pose_t numbers them

struct HealthReport {
  Health health = Health::kStarting;
  std::string reason = "waiting for data";
};

/// Judges the estimate's quality from what came in and how it matched.
class HealthMonitor {
 public:
  explicit HealthMonitor(const HealthConfig& config) : config_(config) {}

  void OnStarted(bool at_rest, double t);
  void OnImu(double t, double previous_t);
  /// A sweep that ended at `end` with `returns` usable points while the newest IMU sample was of
  /// `imu_t` (the same as `end` where there is no IMU).
  void OnSweep(double end, int returns, double imu_t, bool imu_silent);
  /// The sweep's stamps were off and have been put right.
  void OnClock() { sweep_problem_ = "the LiDAR's clock is not the IMU's"; }
  void OnMatch(double end, const MatchResult& match, bool applied);
  /// Stamps and returns of the sweeps have been as usual for a second.
  bool IsUsual(double t) const { return t > unusual_until_; }

  /// `position_sigma`: of the place in the local map, m; `velocity_sigma`: m/s. Where sweeps hold
  /// the body but along a direction that nothing fixes, its place along it matters to nobody who
  /// flies by what he sees: the velocity does.
  HealthReport At(double t, double position_sigma, double velocity_sigma) const;

 private:
  HealthReport Degradation(double t) const;

  HealthConfig config_;
  bool started_ = false;
  bool moving_start_ = false;
  double start_t_ = 0.0;
  double last_good_ = 0.0;
  double usual_returns_ = 0.0;
  double nis_ = 0.0;  // running mean
  int matches_ = 0;   // that were applied, the first sweep among them
  double imu_gap_until_ = -1e18, unusual_until_ = -1e18;
  std::string sweep_problem_;  // of the newest sweep
  std::string match_problem_;
};

}  // namespace chase::odometry
