// Odometry without IMU: the sweeps alone give the motion.
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

namespace {

constexpr int kBootstrapPasses = 3;
const Matrix6d kUnknown = 1e6 * Matrix6d::Identity();  // m, rad: leaves the gate wide

}  // namespace

void Odometry::StartBlind(double t) {
  base_.t = t;
  base_.p = config_.initial_position;
  base_.R_WB = math::FromYaw(InitialYaw());
  base_.P.setZero();
  base_.P.diagonal().segment<3>(kP).setConstant(1e-6);
  base_.P.diagonal().segment<3>(kV).setConstant(100.0);
  base_.P.diagonal().segment<3>(kTheta).setConstant(1e-6);
  live_ = base_;
  started_ = true;
  health_.OnStarted(true, held_ = t);
}

/// Sweeps alone tell no motion that changes within one of them. A silent IMU may be late: such
/// sweeps are published, but not learnt, until their samples come and they are processed again.
/// Not so those that have waited for samples that are known to be late: more wait behind them.
void Odometry::SaveCheckpoint(const Pending& pending) {
  if (!fused_ || planes_.cells() == 0 || SamplesAreLate() ||
      imu_.newest() >= pending.end - kWaitForImu)
    return;
  if (!checkpoint_)
    checkpoint_ = Checkpoint{base_, standing_, level_, drift_, blend_, unknown_, held_, jump_, {}};
  checkpoint_->given_up |= checkpoint_->sweeps.size() == kMostWaiting;
  if (checkpoint_->given_up) return checkpoint_->sweeps.clear();
  checkpoint_->sweeps.push_back(pending);
}

/// Samples come again, from `t` on. To the state before the sweeps, which are processed again, if
/// those samples were late; where some were lost the sweeps stay as they were matched. What was
/// published stays.
void Odometry::CloseCheckpoint(double t) {
  const bool goes_on = t <= imu_.newest() + config_.health.imu_gap;
  if (IsProvisional() && goes_on && t < base_.t) RollBack();
  checkpoint_.reset();
}

void Odometry::RollBack() {
  base_ = checkpoint_->base;
  standing_ = checkpoint_->standing;
  level_ = checkpoint_->level;
  drift_ = checkpoint_->drift;
  blend_ = checkpoint_->blend;
  unknown_ = checkpoint_->unknown;
  held_ = checkpoint_->held;
  jump_ = checkpoint_->jump;
  live_ = base_;
  pending_.insert(pending_.begin(), checkpoint_->sweeps.begin(), checkpoint_->sweeps.end());
}

/// Without IMU the motion over the sweep is what the match makes of it: deskew and match again.
void Odometry::MatchBlind(Prepared* prepared, MatchResult* match) {
  if (!match->valid) return;
  if (first_) return Bootstrap(prepared, match);
  Bend(match->X_WB, prepared);
  const Features features = FeaturesIn(*prepared, prepared->at_end);
  const MatchResult again =
      matcher_.Match(features, planes_, posts_, match->X_WB, kUnknown, unknown_);
  if (again.valid) *match = again;
}

/// The first sweep was learnt and put out as if at rest: once the second one gives the velocity, it
/// is learnt anew. W stays the frame in which the first sweep fits the world as it was put out,
/// which makes the initial pose that of about the sweep's middle.
void Odometry::Bootstrap(Prepared* prepared, MatchResult* match) {
  const Pose initial = base_.pose();
  for (int i = 0; i < kBootstrapPasses && match->valid; ++i) {
    Bend(match->X_WB, prepared);
    const Eigen::Vector3d v = prepared->track.front().v, w_B = prepared->track.front().w_B;
    const double half = 0.5 * Length(*first_);
    const Pose end{initial.R * math::ExpSO3(half * w_B), initial.p + half * v};
    PlaceFirst(end, v, w_B);
    const auto still = Deskewed(first_->sweep.points, X_BL_, SweepMotion::Still());
    const MatchResult raw =
        matcher_.Match(FeaturesIn(*first_, still), planes_, posts_, initial, kUnknown);
    if (raw.valid) PlaceFirst(initial * raw.X_WB.Inverse() * end, v, w_B);
    prepared->track.front() = base_;
    Deskew(prepared);
    const Features features = FeaturesIn(*prepared, prepared->at_end);
    *match = matcher_.Match(features, planes_, posts_, match->X_WB, kUnknown);
  }
  first_.reset();
}

/// Makes the map that of the first sweep, which ended at X_WB in uniform motion.
void Odometry::PlaceFirst(const Pose& X_WB, const Eigen::Vector3d& v, const Eigen::Vector3d& w_B) {
  base_.p = X_WB.p;
  base_.R_WB = X_WB.R;
  first_->track = {base_};
  first_->track.front().v = v;
  first_->track.front().w_B = w_B;
  Deskew(&*first_);
  ClearMap();
  Learn(*first_, X_WB);
}

/// Replaces the track by the uniform motion from its first state to X_WB.
void Odometry::Bend(const Pose& X_WB, Prepared* prepared) const {
  NavState from = prepared->track.front(), to = prepared->track.back();
  const double dt = std::max(1e-3, to.t - from.t);
  from.v = (X_WB.p - from.p) / dt;
  from.w_B = math::LogSO3(from.R_WB.conjugate() * X_WB.R) / dt;
  to.p = X_WB.p;
  to.R_WB = X_WB.R;
  prepared->track = {from, to};
  Deskew(prepared);
}

}  // namespace chase::odometry
