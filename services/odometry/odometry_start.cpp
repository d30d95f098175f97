// How odometry begins where there is an IMU: by what that shows of a body at rest, by the sweeps
// since power-on where they or the IMU show motion.
#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

namespace {

constexpr int kMostPasses = 8;       // through the sweeps since power-on
constexpr double kConverged = 0.02;  // m/s: over a sweep, 2 mm
// m; 36 slopes (of seeds 1 to 40) where it rests: 2 mm in the median, 11 at most while it settles.
constexpr double kMovesAtRest = 0.02;
constexpr double kBlindAtRest = 0.1;  // m/s: a sweep matched 1 cm off, in its 0.1 s

}  // namespace

void Odometry::Align(const ImuSample& imu) {
  aligning_ = true;
  alignment_.Add(imu);
  if (!alignment_.Complete()) return;
  const bool moves = started_ ? base_.v.norm() > kBlindAtRest : SweepsShowMotion();
  if (alignment_.AtRest() && !moves)
    StartAtRest(imu.t);
  else if (started_)
    Join(imu.t);
  else
    StartInMotion(imu.t);
}

PoseEstimate Odometry::AtPowerOn(double t) {
  live_.t = held_ = t;
  live_.p = config_.initial_position;
  live_.R_WB = math::FromYaw(InitialYaw());
  return Estimate();
}

/// The sweeps alone have carried the pose so far.
void Odometry::Join(double t) {
  PropagateBlind(config_.filter, t, &base_);
  const Pose shown = level_.ToWorld(base_.pose());
  base_ = alignment_.ResultAt(config_.filter, base_);
  Begin(t);
  blend_.Absorb(shown, base_.v, level_.ToWorld(base_.pose()), base_.v);
}

/// A map of sweeps that came before the IMU leans as the body stands: it begins anew.
void Odometry::StartAtRest(double t) {
  dropped_sweeps_ += static_cast<int64_t>(pending_.size());
  pending_.clear();
  Pose place{math::FromYaw(InitialYaw()), config_.initial_position};
  if (started_) {
    place = level_.ToWorld(base_.pose());
    ClearMap();
    first_.reset();
    unknown_.setZero();
    drift_ = MapDrift(config_.drift);
    ++epoch_;
  }
  base_ = alignment_.Result(config_.filter, place.p, math::Yaw(place.R));
  level_.BeginAt(base_.R_WB);
  health_.OnStarted(true, held_ = t);
  const ImuStatistics rest = alignment_.statistics();
  standing_.Begin(rest.mean, rest.accel_spread, rest.gyro_spread, base_.p);
  Begin(t);
}

/// Where a coasting body and one at rest feel the same, sweeps tell them apart: the first and the
/// last of the averaged time, as they were measured.
bool Odometry::SweepsShowMotion() {
  size_t i = 0;
  while (i < pending_.size() && pending_[i].sweep.start < alignment_.window_start()) ++i;
  if (i + 1 >= pending_.size()) return false;
  const auto still = [&](Pending pending) {
    Prepared prepared;
    RemoveUnusable(config_.features, &pending.sweep.points);
    Extract(std::move(pending.sweep), &prepared);
    prepared.at_end = Deskewed(prepared.sweep.points, X_BL_, SweepMotion::Still());
    return prepared;
  };
  Learn(still(pending_[i]), Pose{});
  const Prepared last = still(pending_.back());
  const double gate = config_.match.gate;
  const MatchResult match = matcher_.Match(FeaturesIn(last, last.at_end), planes_, posts_, Pose{},
                                           gate * gate * Matrix6d::Identity());
  ClearMap();
  thinning_ = {};
  return match.misfit || match.X_WB.p.norm() > kMovesAtRest;
}

/// The filter runs through all sweeps since power-on, from the pose that is known then. Deskewing
/// and the first sweep's place need the velocity: what the filter found is taken back to power-on,
/// and it begins there again.
void Odometry::StartInMotion(double t) {
  // How it moved before the first sample nobody knows: a sweep begun then would bend the map.
  while (pending_.size() > 1 && pending_.front().sweep.start < alignment_.samples().front().t) {
    pending_.pop_front();
    ++dropped_sweeps_;
  }
  const std::deque<Pending> sweeps = std::move(pending_);
  pending_.clear();
  const Eigen::Vector3d& p = config_.initial_position;
  NavState start = alignment_.InMotion(config_.filter, p, InitialYaw()), placed = start;
  fused_ = started_ = true;
  double change = kConverged;  // of the velocity at power-on
  for (int pass = 0; pass < kMostPasses && change >= kConverged; ++pass) {
    base_ = start;
    held_ = base_.t;
    ClearMap();
    unknown_.setZero();
    drift_ = MapDrift(config_.drift);
    for (const Pending& sweep : sweeps) Follow(sweep, placed);
    NavState last = base_;
    imu_.Advance(t, &last);
    const NavState first = alignment_.AtFirst(config_.filter, last);
    change = (first.v - start.v).norm();
    placed = start = alignment_.InMotion(config_.filter, p, InitialYaw(), first);
    placed.P = first.P;
    PutAtOrigin(&placed);
  }
  level_.BeginAt(start.R_WB);
  health_.OnStarted(false, t);
  Begin(t);
}

/// A sweep of the start. The map begins where the first one finds the body; `placed` is the body at
/// power-on as well as its velocity is known.
void Odometry::Follow(Pending pending, NavState placed) {
  Prepared prepared;
  if (!Prepare(std::move(pending), &prepared)) return;
  const bool first = planes_.cells() == 0;
  MatchResult match = Match(&prepared);
  match.valid |= first;
  const bool applied = !first && Apply(prepared, &match);
  if (!applied) base_ = prepared.inertial;
  if (first) {
    BeginMapHere();
    imu_.Advance(prepared.end, &placed);
    PlaceMap(placed);
  }
  if (first || applied) Learn(prepared, base_.pose());
  if (first || applied) held_ = prepared.end;
  health_.OnMatch(prepared.end, match, first || applied);
}

void Odometry::Begin(double t) {
  live_ = base_;
  imu_.Advance(t, &live_);
  level_.Turn(base_);
  began_ = t;
  fused_ = started_ = true;
  imu_.DropBefore(base_.t);
}

}  // namespace chase::odometry
