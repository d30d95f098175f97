// How odometry starts where there is an IMU: at rest by what that shows, in flight by the sweeps.
#include <cmath>
#include <utility>

#include "common/math/rotation.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

namespace {

constexpr double kMoved = 0.15;    // m: a body that is let down on its legs slides by less
constexpr double kShifted = 0.03;  // m: ten times what a body at rest seems to move
constexpr double kCoasts = 0.1;    // m/s: three times what it seems to be as fast as

}  // namespace

void Odometry::Align(const ImuSample& imu) {
  aligning_ = true;
  alignment_.Add(imu);
  const bool rests = alignment_.Complete() && alignment_.AtRest();
  if (scout_ && (scout_->Shift() > kMoved || (rests && scout_->Coasts()))) TakeOver();
  const bool was_blind = started_, moves = was_blind && Coasts();
  if (!alignment_.Complete(moves)) return;
  if (was_blind) {
    PropagateBlind(config_.filter, imu.t, &base_);
    base_ = alignment_.ResultAt(config_.filter, base_, moves);
  } else {
    base_ = alignment_.Result(config_.filter, config_.initial_position,
                              config_.initial_yaw_deg * M_PI / 180.0);
    health_.OnStarted(alignment_.AtRest(), held_ = imu.t);
    if (!alignment_.AtRest()) sweeps_to_anchor_ = 2;
  }
  if (!was_blind && alignment_.AtRest()) {
    const ImuStatistics rest = alignment_.statistics();
    standing_.Begin(rest.mean, rest.accel_spread, rest.gyro_spread, base_.p);
  }
  const Pose shown = level_.ToWorld(base_.pose());
  live_ = base_;
  level_.SetGravity(base_.g);
  if (was_blind) blend_.Absorb(shown, base_.v, level_.ToWorld(base_.pose()), base_.v);
  fused_ = started_ = true;
  scout_.reset();
  imu_.DropBefore(base_.t);
}

/// While it is aligned, the sweeps tell whether the body moves: one that hovers or coasts feels
/// what one at rest feels.
void Odometry::Scout(Sweep sweep) {
  ++dropped_sweeps_;
  if (!scout_) scout_ = std::make_unique<Odometry>(config_);
  scout_->AddSweep(std::move(sweep));
  while (scout_->SweepReady()) scout_->ProcessSweep();
}

double Odometry::Shift() const {
  return started_ ? (base_.p - config_.initial_position).norm() : 0.0;
}

bool Odometry::Coasts() const { return Shift() > kShifted && base_.v.norm() > kCoasts; }

/// Goes on from what the sweeps alone have shown: map, pose and velocity.
void Odometry::TakeOver() {
  Odometry scout = std::move(*scout_);
  scout.heard_ = heard_;
  scout.imu_ = std::move(imu_);
  scout.spikes_ = spikes_;
  scout.clock_ = clock_;
  scout.alignment_ = std::move(alignment_);
  scout.aligning_ = true;
  scout.dropped_sweeps_ += dropped_sweeps_;
  scout.dropped_samples_ = dropped_samples_;
  *this = std::move(scout);
  health_.OnStarted(false, base_.t);
}

}  // namespace chase::odometry
