#include "services/odometry/health_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace chase::odometry {

namespace {

constexpr double kSettlingAfterMovingStart = 2.0;  // s
constexpr double kNisShare = 0.6;                  // of a sweep in the running mean
constexpr int kMatchesToBegin = 3;                 // before them nothing can be lost
constexpr double kImuGapRemembered = 0.2;          // s

std::string Text(const char* format, double value) {
  char buffer[128];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// "x", "y", "z" or a rotation: the axis that a direction of (p, rotation error) mostly points to.
std::string Named(const Vector6d& direction) {
  static const char* const kNames[] = {"along x", "along y", "along z",
                                       "about x", "about y", "about z"};
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  return kNames[largest];
}

}  // namespace

void HealthMonitor::OnStarted(bool at_rest, double t) {
  started_ = true;
  moving_start_ = !at_rest;
  start_t_ = last_good_ = t;
}

void HealthMonitor::OnImu(double t, double previous_t) {
  if (t - previous_t > config_.imu_gap) imu_gap_until_ = t + kImuGapRemembered;
}

void HealthMonitor::OnSweep(double end, int returns, double imu_t, bool imu_silent) {
  sweep_problem_.clear();
  const double usual = usual_returns_;
  usual_returns_ = usual == 0.0 ? returns : usual + 0.05 * (returns - usual);
  if (imu_silent)
    sweep_problem_ = "no IMU: motion is extrapolated";
  else if (std::abs(end - imu_t) > config_.late_sweep)
    sweep_problem_ =
        Text("sweep ends %.0f ms away from the newest IMU sample", 1e3 * (imu_t - end));
  else if (returns < (1.0 - config_.dropped_share) * usual)
    sweep_problem_ = Text("%.0f %% of the usual returns", 100.0 * returns / usual);
  if (!sweep_problem_.empty()) unusual_until_ = end + 1.0;
}

void HealthMonitor::OnMatch(double end, const MatchResult& match, bool applied) {
  match_problem_.clear();
  if (applied) last_good_ = end;
  matches_ += applied ? 1 : 0;
  if (applied) nis_ += kNisShare * (match.nis - nis_);
  if (match.misfit)
    match_problem_ = Text("sweep contradicts the map: %.0f %% fit", 100.0 * match.fit);
  else if (!match.valid)
    match_problem_ = "sweep shows nothing that is mapped";
  else if (nis_ > config_.usual_nis)
    match_problem_ = Text("corrections are %.0f times what the covariance explains", nis_);
  else if (!applied)
    match_problem_ = "scan match refused by the filter";
  else if (match.degenerate())
    match_problem_ = "surroundings do not fix motion " + Named(match.weakest);
}

HealthReport HealthMonitor::Degradation(double t) const {
  if (t - last_good_ > config_.degraded_after)
    return {Health::kDegraded, match_problem_.empty()
                                   ? Text("no usable sweep for %.1f s", t - last_good_)
                                   : match_problem_};
  if (t < imu_gap_until_) return {Health::kDegraded, "gap in the IMU's samples"};
  if (!match_problem_.empty()) return {Health::kDegraded, match_problem_};
  if (!sweep_problem_.empty()) return {Health::kDegraded, sweep_problem_};
  if (moving_start_ && t - start_t_ < kSettlingAfterMovingStart)
    return {Health::kDegraded, "started in motion"};
  return {Health::kOk, ""};
}

HealthReport HealthMonitor::At(double t, double position_sigma, double velocity_sigma) const {
  if (!started_) return {Health::kStarting, "aligning"};
  const bool blind = t - last_good_ > config_.degraded_after;
  if (blind && position_sigma > config_.lost_sigma && matches_ >= kMatchesToBegin)
    return {Health::kLost, Text("position uncertain by %.2f m", position_sigma)};
  if (velocity_sigma > config_.lost_speed && matches_ >= kMatchesToBegin)
    return {Health::kLost, Text("velocity uncertain by %.2f m/s", velocity_sigma)};
  return Degradation(t);
}

}  // namespace chase::odometry
