#include "services/odometry/odometry.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

constexpr double kKnotStep = 0.005;     // s, of the motion over a sweep
constexpr double kLongestReplay = 3.0;  // s of inertial samples kept for late sweeps
constexpr double kSettles = 2.0;        // s from the filter's beginning
constexpr double kUsualGap = 0.25;      // s between sweeps that were of use
constexpr double kHoldLag = 0.15;       // s for which a sweep may still come while it stands
constexpr double kLeastTurn = 1e-2;     // of known directions that is one found
constexpr double kAtTheOrigin = 1e-4;   // m, rad: a body in a map that begins there
constexpr size_t kMostKept = 32;        // sweeps that wait for the alignment

Pose ExtrinsicsOf(const world::Rig& rig) {
  return {Eigen::Quaterniond(rig.R_BL()), rig.lidar_position};
}

double LastTime(const std::vector<SweepPoint>& points) {
  float last = 0.0f;
  for (const SweepPoint& point : points) last = std::max(last, point.t);
  return static_cast<double>(last);
}

std::vector<Eigen::Vector3f> Picked(const std::vector<Eigen::Vector3f>& points,
                                    const std::vector<int>& indices) {
  std::vector<Eigen::Vector3f> out;
  out.reserve(indices.size());
  for (int i : indices) out.push_back(points[static_cast<size_t>(i)]);
  return out;
}

std::vector<Eigen::Vector3f> Moved(const FloatPose& X, std::vector<Eigen::Vector3f> points) {
  for (Eigen::Vector3f& p : points) p = X * p;
  return points;
}

Matrix6d PosePart(const NavState& state) {
  Matrix6d P;
  P << state.P.block<3, 3>(kP, kP), state.P.block<3, 3>(kP, kTheta),
      state.P.block<3, 3>(kTheta, kP), state.P.block<3, 3>(kTheta, kTheta);
  return P;
}

double UncertaintyOf(const NavState& state) { return odometry::UncertaintyOf(PosePart(state)); }

/// Error of a body in (p, yaw).
MapDrift::Covariance PlaceCovariance(const Matrix6d& P) {
  MapDrift::Covariance out;
  out << P.topLeftCorner<3, 3>(), P.topRightCorner<3, 1>(), P.bottomLeftCorner<1, 3>(), P(5, 5);
  return out;
}

}  // namespace

Odometry::Odometry(const OdometryConfig& config)
    : config_(config),
      X_BL_(ExtrinsicsOf(config.rig)),
      matcher_(config.match),
      planes_(config.map, SurfaceKind::kPlane),
      posts_(config.map, SurfaceKind::kLine),
      imu_(config.filter, config.health.imu_gap),
      spikes_(config.spikes),
      alignment_(config.alignment),
      level_(config.initial_position),
      drift_(config.drift),
      blend_(config.blend),
      health_(config.health) {}

std::optional<PoseEstimate> Odometry::AddImu(const ImuSample& imu) {
  if (!imu.accel.allFinite() || !imu.gyro.allFinite() || imu.t <= heard_) {
    ++dropped_samples_;
    return std::nullopt;
  }
  heard_ = imu.t;
  if (sweeps_since_ > 0) samples_late_ = imu.t < newest_sweep_ - kWaitForImu;
  sweeps_since_ = 0;
  const auto is_reached = [this](double end) { return end <= heard_; };
  ends_beyond_imu_.erase(
      std::remove_if(ends_beyond_imu_.begin(), ends_beyond_imu_.end(), is_reached),
      ends_beyond_imu_.end());
  const std::vector<ImuSample> samples = spikes_.Take(imu);
  if (!samples.empty()) CloseCheckpoint(samples.front().t);
  for (const ImuSample& sample : samples) Take(sample);
  if (!fused_) return started_ ? std::nullopt : std::optional(AtPowerOn(imu.t));
  const double dt = imu.t - live_.t;
  if (dt < 0.0) return std::nullopt;  // sweeps have led beyond a sample that comes late
  imu_.Advance(imu.t, &live_);
  blend_.Decay(dt);
  HoldBetweenSweeps(imu.t);
  if (imu.t - base_.t > kLongestReplay) {
    imu_.Advance(imu.t - 0.5 * kLongestReplay, &base_);
    imu_.DropBefore(base_.t);
  }
  return NewEstimate();
}

void Odometry::Take(const ImuSample& imu) {
  const double previous = imu_.newest();
  imu_.Add(imu);
  if (!fused_) return Align(imu);
  health_.OnImu(imu.t, previous);
  standing_.Add(imu, live_);
}

void Odometry::AddSweep(Sweep sweep) {
  if (!std::isfinite(sweep.start)) {
    ++dropped_sweeps_;
    return;
  }
  if (Aligns() && pending_.size() >= kMostKept) {
    pending_.pop_front();
    ++dropped_sweeps_;
  }
  ++sweeps_since_;
  double end = sweep.start + LastTime(sweep.points);
  if (!imu_.empty()) {
    const double correction = clock_.Correction(end, imu_.newest());
    sweep.start += correction, end += correction;
  }
  newest_sweep_ = end;
  if (fused_ && end > heard_) ends_beyond_imu_.push_back(end);
  pending_.push_back({std::move(sweep), imu_.newest(), end});
}

bool Odometry::SweepReady() const {
  if (pending_.empty() || Aligns()) return false;
  const double end = pending_.front().end;
  if (SamplesAreLate() && pending_.size() <= kMostWaiting) return imu_.newest() >= end;
  if (!fused_ || pending_.size() > 1) return true;
  return imu_.newest() >= end || imu_.newest() < end - kWaitForImu;
}

SweepResult Odometry::ProcessSweep() {
  SweepResult result;
  Prepared prepared;
  Pending pending = std::move(pending_.front());
  pending_.pop_front();
  SaveCheckpoint(pending);
  if (!Prepare(std::move(pending), &prepared)) return result;
  const bool blind = Blind(prepared.end), lost = Estimate().health.health == Health::kLost;
  result.match = Match(&prepared);
  bool first = planes_.cells() == 0;
  if (first) result.match.valid = true;
  const bool applied = first || Apply(prepared, &result.match);
  if (!applied) base_ = prepared.inertial;
  const bool beyond = (first || !applied) && UncertaintyOf(prepared.predicted) > config_.match.gate;
  first |= beyond;
  if (first) base_ = prepared.predicted;
  if (!first && !applied && standing_.holds()) {
    HoldStill(standing_.gyro(), &base_);
    held_ = prepared.end;
  }
  if (beyond) RestartMap();
  if (first) checkpoint_.reset();
  result.applied = applied;
  if (applied) held_ = prepared.end;
  if (applied && !first && !blind) Straighten(&prepared);
  health_.OnMatch(prepared.end, result.match, applied);
  if (blind && applied && !first)
    base_.w_B = math::LogSO3(prepared.track.front().R_WB.conjugate() * base_.R_WB) /
                std::max(1e-3, prepared.end - prepared.track.front().t);
  const bool extends = !first && Extends(result.match);
  if (extends) unknown_.setIdentity();
  const bool learns = applied || planes_.cells() == 0 || extends;
  if (learns && !IsProvisional() && !jump_) Learn(prepared, base_.pose());
  if (applied && !first) FollowDrift(result.match);
  Catchup(lost);
  if (blind) result.pose = NewEstimate();
  if (prepared.end > newest_registered_) {
    newest_registered_ = prepared.end;
    result.registered = Registered(prepared);
    result.registered->health = Estimate().health.health;
  }
  if (first && !fused_) first_ = std::move(prepared);
  return result;
}

bool Odometry::Prepare(Pending pending, Prepared* prepared) {
  Sweep& sweep = pending.sweep;
  RemoveUnusable(config_.features, &sweep.points);
  const int returns = static_cast<int>(sweep.points.size());
  prepared->end = sweep.start + LastTime(sweep.points);
  if (!started_ && returns > 0) StartBlind(prepared->end - 1e-6);
  if (!started_) return false;
  const bool silent = fused_ && imu_.newest() < prepared->end - kWaitForImu;
  health_.OnSweep(prepared->end, returns, fused_ ? pending.imu_t : prepared->end, silent);
  if (clock_.stepped()) health_.OnClock();
  if (returns == 0) {
    health_.OnMatch(prepared->end, MatchResult{}, false);
    return false;
  }
  if (prepared->end <= base_.t) {
    ++dropped_sweeps_;
    return false;
  }
  Extract(std::move(sweep), prepared);
  prepared->track = {base_};
  prepared->predicted = base_;
  imu_.Advance(prepared->end, &prepared->predicted, &prepared->track);
  prepared->inertial = prepared->predicted;
  prepared->predicted = Doubted(prepared->predicted);
  Deskew(prepared);
  return true;
}

void Odometry::Extract(Sweep sweep, Prepared* prepared) {
  prepared->sweep = std::move(sweep);
  prepared->features = ExtractFeatures(config_.features, prepared->sweep.points);
  prepared->matched_planes =
      thinning_.Evenly(prepared->sweep.points, prepared->features.planes, config_.match_points);
}

void Odometry::Deskew(Prepared* prepared) const {
  const double length = Length(*prepared);
  const int steps = std::max(1, static_cast<int>(std::ceil(length / kKnotStep)));
  const double step = std::max(length / steps, 1e-6);
  const SweepMotion motion(PosesOver(prepared->track, prepared->sweep.start, step, steps + 1),
                           step);
  prepared->at_end = Deskewed(prepared->sweep.points, X_BL_, motion);
}

std::vector<Eigen::Vector3f> Odometry::Axes(const Prepared& prepared,
                                            const std::vector<Eigen::Vector3f>& points) const {
  const Eigen::Matrix3f R_BL = X_BL_.R.toRotationMatrix().cast<float>();
  std::vector<Eigen::Vector3f> out;
  for (const Post& post : prepared.features.posts)
    out.push_back(points[static_cast<size_t>(post.point)] + R_BL * post.to_axis);
  return out;
}

Features Odometry::FeaturesIn(const Prepared& prepared,
                              const std::vector<Eigen::Vector3f>& points) const {
  return {Picked(points, prepared.matched_planes), Axes(prepared, points), X_BL_.p.cast<float>()};
}

/// A sweep whose stamps are not as usual may be of a while earlier or later.
Matrix6d Odometry::PriorOf(const Prepared& prepared) const {
  Matrix6d P = PosePart(prepared.predicted);
  if (health_.IsUsual(prepared.end)) return P;
  Vector6d motion;
  motion << prepared.predicted.v, prepared.predicted.R_WB * prepared.predicted.w_B;
  motion *= config_.health.late_sweep;
  return P + motion * motion.transpose();
}

MatchResult Odometry::Match(Prepared* prepared) {
  if (planes_.cells() == 0) return {};
  MatchResult match = matcher_.Match(FeaturesIn(*prepared, prepared->at_end), planes_, posts_,
                                     prepared->predicted.pose(), PriorOf(*prepared), unknown_);
  if (Blind(prepared->end)) MatchBlind(prepared, &match);
  return match;
}

bool Odometry::Apply(const Prepared& prepared, MatchResult* match) {
  const bool blind = Blind(prepared.end);
  if (jump_ && (blind || jump_->state.t != base_.t || prepared.end - base_.t > kUsualGap))
    jump_.reset();
  if (!match->valid || Astray(prepared, *match)) {
    jump_.reset();
    return false;
  }
  if (jump_) imu_.Advance(prepared.end, &jump_->state);
  NavState state = prepared.predicted;
  standing_.See(match->X_WB.p);
  if (standing_.holds()) HoldStill(standing_.gyro(), &state);
  // Stamps that are off look like biases that jumped.
  const double gap = health_.IsUsual(prepared.end) ? prepared.end - held_ : 0.0;
  // Before the filter has settled everything explains everything.
  const bool settled = prepared.end - began_ > kSettles && !blind;
  const UpdateResult update =
      Update(config_.filter, {match->X_WB, match->known, match->information, match->gate}, gap,
             &state, settled ? &jump_ : nullptr);
  match->nis = update.nis;
  match->misfit = update.nis > config_.filter.largest_nis;
  if (!update.applied) return false;
  CarryUnknown(*match, prepared.predicted);
  DoubtAcceleration(config_.filter, unknown_.topLeftCorner<3, 3>(), &state);
  base_ = state;
  return true;
}

/// A direction that the map held until now holds no longer, and the body may be farther off along
/// it than a match reaches: it may be anywhere in the map, and what seemed to fit another place.
bool Odometry::Astray(const Prepared& prepared, const MatchResult& match) const {
  if (Blind(prepared.end)) return false;
  const Matrix6d open = Matrix6d::Identity() - match.known * match.known.transpose();
  const Matrix6d lost = open * (Matrix6d::Identity() - unknown_);
  return UncertaintyOf(lost * PosePart(prepared.predicted) * lost.transpose()) > config_.match.gate;
}

/// What was seen while a direction was unknown has been mapped as far off along it as the body was.
/// Once that is matched, the body is known in the map, the map no better than before.
void Odometry::CarryUnknown(const MatchResult& match, const NavState& prior) {
  const Matrix6d known = match.known * match.known.transpose();
  const Matrix6d found = known * unknown_;
  unknown_ = Matrix6d::Identity() - known;
  if (found.squaredNorm() < kLeastTurn) return;
  drift_.GoAstray(PlaceCovariance(found * PosePart(prior) * found.transpose()));
}

/// A sweep is deskewed by the velocity as predicted. Where the match corrects that by more than the
/// noise of a range over a sweep, it is deskewed anew, and a map of one sweep, which was bent as
/// much, begins again with this one.
void Odometry::Straighten(Prepared* prepared) {
  const Eigen::Vector3d dv = base_.v - prepared->predicted.v;
  if (dv.norm() * Length(*prepared) < config_.match.range_noise) return;
  for (NavState& state : prepared->track) state.p -= (prepared->end - state.t) * dv;
  Deskew(prepared);
  if (sweeps_learnt_ > 1) return;
  PlaceMap(base_);
  BeginMapHere();
}

/// A sweep over ground that the map does not know extends it while inertia still tells the pose
/// within a cell.
bool Odometry::Extends(const MatchResult& match) const {
  return !match.valid && !match.misfit && UncertaintyOf(base_) < config_.map.cell_size;
}

void Odometry::Learn(const Prepared& prepared, const Pose& X_WB) {
  std::vector<int> planes;
  for (size_t i = 0; i < prepared.features.planes.size();
       i += static_cast<size_t>(config_.map_stride))
    planes.push_back(prepared.features.planes[i]);
  ++sweeps_learnt_;
  const FloatPose to_world(X_WB);
  const Eigen::Vector3f eye = to_world * Eigen::Vector3f(X_BL_.p.cast<float>());
  planes_.Add(Moved(to_world, Picked(prepared.at_end, planes)), eye);
  posts_.Add(Moved(to_world, Axes(prepared, prepared.at_end)), eye);
  planes_.Prune(X_WB.p.cast<float>());
  posts_.Prune(X_WB.p.cast<float>());
}

void Odometry::FollowDrift(const MatchResult& match) {
  if (drift_.places() == 0 && !match.degenerate()) {
    const Matrix6d covariance = match.information.inverse();
    MapDrift::Covariance first = MapDrift::Covariance::Zero();
    first.diagonal() << covariance.diagonal().head<3>(), covariance(5, 5);
    if (first.allFinite()) drift_.Begin(first);
  }
  drift_.MoveTo(base_.p, match.view);
}

/// The map is of no use to a body that may be farther off than a match reaches. A new one begins at
/// the pose as it is believed; what that may be off is from now on the error of the map.
void Odometry::RestartMap() {
  PlaceMap(base_);
  BeginMapHere();
  held_ = base_.t;
  ++epoch_;
}

/// The map lies as far astray as `state` may be off, besides what it was.
void Odometry::PlaceMap(const NavState& state) {
  drift_.Restart(drift_.covariance() + PlaceCovariance(PosePart(state)));
}

void Odometry::BeginMapHere() {
  PutAtOrigin(&base_);
  jump_.reset();
  ClearMap();
  unknown_.setZero();
}

void Odometry::ClearMap() {
  planes_.Clear();
  posts_.Clear();
  sweeps_learnt_ = 0;
}

/// In a map that begins at the body it is by definition where it is believed to be.
void Odometry::PutAtOrigin(NavState* state) {
  for (const int row : {kP + 0, kP + 1, kP + 2, kTheta + 2}) {
    state->P.row(row).setZero();
    state->P.col(row).setZero();
    state->P(row, row) = kAtTheOrigin * kAtTheOrigin;
  }
}

/// While no sweep comes, a body that stands is held by that alone.
void Odometry::HoldBetweenSweeps(double t) {
  if (!standing_.holds() || t - base_.t < 2.0 * kHoldLag) return;
  imu_.Advance(t - kHoldLag, &base_);
  HoldStill(standing_.gyro(), &base_);
  held_ = base_.t;
  Catchup();
}

/// What inertia may be off by more than its noise, since the state was last held.
NavState Odometry::Doubted(NavState state) const {
  const double gap = state.t - held_;
  if (gap > kUsualGap) Doubt(config_.filter, gap, &state);
  return state;
}

/// Brings the newest state up from the last sweep; what is put out moves there smoothly. The
/// velocity of a lost one does so at once: nobody flies by it, and whoever shall again needs the
/// new one.
void Odometry::Catchup(bool lost) {
  const double t = live_.t;
  NavState before = live_;
  live_ = base_;
  if (!fused_) return;
  imu_.DropBefore(IsProvisional() ? checkpoint_->base.t : base_.t);
  if (t > live_.t) imu_.Advance(t, &live_);
  if (live_.t > t) imu_.Advance(live_.t, &before);
  const Pose shown = level_.ToWorld(before);
  const Eigen::Vector3d shown_v = level_.R_WM() * before.v;
  level_.Turn(live_);
  const Eigen::Vector3d v = level_.R_WM() * live_.v;
  blend_.Absorb(shown, lost ? v : shown_v, level_.ToWorld(live_), v);
}

}  // namespace chase::odometry
