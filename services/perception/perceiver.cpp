#include "services/perception/perceiver.h"

#include <algorithm>
#include <cmath>

#include "services/perception/sightings.h"

namespace chase::perception {

namespace {

constexpr double kUnknownVariance = 1e4;  // m^2, while nothing is known
constexpr double kGateSigmas = 3.0;
constexpr int kCandidateMisses = 2;  // frames without it that end a candidate
constexpr size_t kMaxCandidates = 6;
constexpr double kLeastWidthPx = 6.0;  // what is narrower may be a slit between things
constexpr int kDecoyHits = 3;  // sightings that what stands beside one that drives counts for
constexpr double kReachMargin = 0.5;    // m
constexpr double kUsualSpeed = 1.5;     // m/s
constexpr int kSoonBack = 6;            // frames hidden after which one side at most may be
constexpr double kReachGate = 11.3;     // squared distance from a hidden target's prediction, 3 dof
constexpr double kExpectedGate = 4.6;   // likewise of what need not drive, 2 dof
constexpr double kTimeJump = 1.0;       // s back that count as a new recording
constexpr int kSureHits = 5;            // corrections after which the track is trusted
constexpr int kProvenHits = 20;         // before, it may have been another thing
constexpr int kPieceHits = 4;           // sightings of a piece or a half before it is taken,
constexpr double kPieceWay = 0.15;      // m that it must have driven,
constexpr int kNewPieceHits = 10;       // and where none was ever seen, nor LiDAR tells much
constexpr double kNewPieceWay = 0.3;    // m, likewise
constexpr double kDecoySigma = 0.1;     // m, how well its place is known
constexpr double kDrivenSigma = 0.1;    // m, how well that must be known
constexpr double kStood = 0.2;          // m, within which a target stands
constexpr double kStoodFor = 0.6;       // s, likewise
constexpr double kFar = 5.0;            // m, from where fewer pixels tell what stands there
constexpr double kTrusted = 0.3;        // s that a track not seen is preferred to anything new
constexpr double kStandingSpeed = 0.2;  // m/s

double HorizontalSigma(const TargetTrack& track) {
  return std::sqrt(track.state.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
}

}  // namespace

Perceiver::Perceiver(const PerceptionConfig& config)
    : config_(config), finder_(config), decoys_(config.state) {}

/// True when a look-alike known to stand there explains a sighting better than the target does.
bool Perceiver::IsRatherDecoy(const Sighting& s, const View& view) const {
  const Decoy* decoy = decoys_.At(s.fit.posterior.position());
  if (!decoy) return false;
  TargetTrack standing{s.fit.posterior, s.fit.shape, view.t, view.t, 1, 0};
  standing.state.mean << decoy->p_W, Eigen::Vector3d::Zero();
  standing.state.covariance = Matrix6d::Identity() * kDecoySigma * kDecoySigma;
  if (track_) {  // on the same terms
    standing.misses = track_->misses;
    standing.joined = track_->joined;
  }
  const auto other = finder_.Try(standing, view, s.detection, false);
  return other && other->fit.log_odds > s.fit.log_odds;
}

bool Perceiver::Plausible(const Sighting& s, double t) const {
  const Eigen::Vector3d p_WT = s.fit.posterior.position();
  if (decoys_.At(p_WT)) return false;
  if (!track_ || doubtful_ || track_->hits < kProvenHits) return true;
  const Eigen::Vector3d d = p_WT - track_->state.position();
  if (state_ != TargetState::kLost) {
    if (std::abs(d.z()) >= kGateSigmas * config_.motion.ground_sigma) return false;
    const Eigen::Matrix3d P = track_->state.covariance.topLeftCorner<3, 3>();
    if (d.dot(P.ldlt().solve(d)) < kReachGate) return true;
    // The prediction may err by more than it claims, where the fit slipped to what stood behind.
    const double way = (p_WT - last_p_).norm();
    return Clear(s) && way < kReachMargin + kUsualSpeed * (t - track_->seen);
  }
  return d.norm() < kReachMargin + config_.motion.max_speed * (t - track_->seen);
}

/// Hidden for so long that a look-alike may lie where the target may be as well.
bool Perceiver::Vague() const {
  return track_->misses > 0 && HorizontalSigma(*track_) > config_.state.sure_sigma;
}

/// True for a sighting after which nothing need be asked: all of the target, close to where it was
/// expected, and nothing else that could be it.
bool Perceiver::Sure(const Sighting& s) const {
  if (track_->misses == 0) return true;
  if (s.contested) return false;
  const Eigen::Vector2d off = (s.fit.posterior.position() - track_->state.position()).head<2>();
  if (Vague()) return AllSeen(s) && off.norm() < config_.state.decoy_radius;
  if (LeftOut(s) > 1 && track_->misses > kSoonBack) return false;
  const Eigen::Matrix2d P = track_->state.covariance.topLeftCorner<2, 2>();
  return off.norm() < config_.state.decoy_radius || off.dot(P.ldlt().solve(off)) < kExpectedGate;
}

void Perceiver::Follow(View* view) {
  if (!track_) return;
  const auto refuses = [&](const Sighting& s) { return IsRatherDecoy(s, *view); };
  auto taken = view->taken;
  const auto found = finder_.Find(*track_, view, refuses);
  contested_ = found && found->contested && track_->misses > 0;
  if (!found || !Sure(*found)) {
    view->taken = taken;
    ++track_->misses;
    unsure_ = found;
    return;
  }
  sighting_ = found;
  track_->Correct(found->fit);
  if (!doubtful_) candidates_.clear();
}

void Perceiver::FollowCandidates(View* view) {
  for (auto& c : candidates_) {
    const auto again = finder_.Find(c.track, view, [&](const Sighting& s) {
      return (s.detection.part || s.detection.edged) && !c.part;
    });
    if (again && (again->fit.whole || c.track.partial || again->detection.edged))
      c.Correct(*again);
    else
      ++c.track.misses;
  }
  DropMissed();
}

void Perceiver::DropMissed() {
  candidates_.erase(
      std::remove_if(candidates_.begin(), candidates_.end(),
                     [](const Candidate& c) { return c.track.misses >= kCandidateMisses; }),
      candidates_.end());
}

bool Perceiver::MayBeNew(const Detection& d) const {
  return (d.edged || d.score >= config_.state.acquire_score) && d.box.width >= kLeastWidthPx;
}

/// True when a candidate is followed there.
bool Perceiver::Followed(const Sighting& s) const {
  return std::any_of(candidates_.begin(), candidates_.end(), [&](const Candidate& c) {
    return (c.track.state.position() - s.fit.posterior.position()).norm() <
           config_.state.decoy_radius;
  });
}

/// What may be the hidden target, half of it seen, is followed on its own to see whether it drives.
void Perceiver::AddPartial(const View& view) {
  if (!unsure_ || unsure_->fit.whole || unsure_->n_points == 0) return;
  if (Followed(*unsure_) || candidates_.size() >= kMaxCandidates) return;
  if (!Plausible(*unsure_, view.t)) return;
  candidates_.push_back(NewCandidate(*unsure_, view));
  ForgetVelocity(config_.motion, &candidates_.back());
}

void Perceiver::AddCandidates(View* view) {
  std::vector<size_t> order;  // near before far, the middle before the border
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && MayBeNew(view->detections[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return Prominence(view->detections[a], config_.rig) >
           Prominence(view->detections[b], config_.rig);
  });
  const bool comes_back = track_ && !doubtful_ && track_->hits >= kProvenHits;
  for (const size_t i : order) {
    if (candidates_.size() >= kMaxCandidates) return;
    const auto found = finder_.Acquire(*view, view->detections[i]);
    if (!found || !Plausible(*found, view->t)) continue;
    // Part of something, of which no LiDAR point tells the range, is a thing of its own only where
    // the target may come back.
    const bool piece = found->detection.part || found->detection.edged;
    if ((piece || !found->fit.whole) && found->n_points == 0 && !comes_back) continue;
    if (piece && ((found->n_points == 0 && !found->detection.edged) || Followed(*found))) continue;
    if (!found->fit.whole && Followed(*found)) continue;
    candidates_.push_back(NewCandidate(*found, *view));
  }
}

void Perceiver::Seek(View* view) {
  if (sighting_ && !doubtful_) return;
  FollowCandidates(view);
  AddPartial(*view);
  AddCandidates(view);
  Promote(*view);
}

/// What drives is taken at once, a piece of something larger once it has driven further, since what
/// shows of it may change as well; what stands only after a while, unless the target stood there. A
/// target that drove when it was last seen must have had the time to stop.
bool Perceiver::Ready(const Candidate& c, double t) const {
  if (c.track.misses > 0 || c.track.hits < config_.state.confirm_frames) return false;
  const bool trusted = !doubtful_ && !contested_ && !Vague();
  if (track_ && trusted && t - track_->seen < kTrusted) return false;
  const bool cut = LeavesImage(c.last.detection);
  if (c.part || c.track.partial || cut) {
    const bool hasty = !track_ && (cut || c.last.n_points < kClearPoints);
    return c.SurelyDrives(hasty ? kNewPieceWay : kPieceWay) &&
           c.track.hits >= (hasty ? kNewPieceHits : kPieceHits);
  }
  if (c.Drives()) return true;
  if (sighting_) return false;
  const bool stood_here = track_ && last_v_.norm() < kStandingSpeed &&
                          (c.track.state.position() - last_p_).norm() < config_.state.decoy_radius;
  const bool may_stand =
      !c.last.detection.AnyCut() && (!track_ || t - track_->seen > config_.motion.hidden_time);
  const double range = c.px * config_.rig.focal_px;
  const double wait = config_.state.standing_after * std::max(1.0, std::pow(range / kFar, 2));
  return stood_here || (may_stand && range < config_.state.standing_range && t - c.since >= wait);
}

void Perceiver::Promote(const View& view) {
  const auto better = [](const Candidate& a, const Candidate& b) {
    return a.Drives() != b.Drives() ? a.Drives() : a.since < b.since;
  };
  const Candidate* best = nullptr;
  for (const auto& c : candidates_)
    if (Ready(c, view.t) && (!best || better(c, *best))) best = &c;
  if (!best) return;
  const Candidate chosen = *best;
  for (const auto& c : candidates_)
    if (&c != best && chosen.Drives() && !c.Drives() && !c.part &&
        c.track.hits >= config_.state.confirm_frames)
      decoys_.Note(c.track.state.position(), view.t, kDecoyHits);
  if (sighting_) decoys_.Note(track_->state.position(), view.t, kDecoyHits);
  Start(chosen.track, chosen.last);
  doubtful_ = !chosen.Drives();
  candidates_.clear();
}

void Perceiver::Start(const TargetTrack& track, const Sighting& sighting) {
  track_ = track;
  doubtful_ = false;
  stood_ = track.state.position();
  stood_since_ = track.t;
  sighting_ = sighting;
  state_ = TargetState::kTracking;
}

void Perceiver::Judge(double t) {
  if (!track_) return;
  const double unseen = t - track_->seen;
  if (unseen < config_.state.hidden_after)
    state_ = TargetState::kTracking;
  else if (state_ != TargetState::kLost)
    state_ =
        unseen > config_.state.lost_after || HorizontalSigma(*track_) > config_.state.lost_sigma
            ? TargetState::kLost
            : TargetState::kOccluded;
  if (unseen > 0.0) return;
  last_v_ = track_->state.velocity();
  last_p_ = track_->state.position();
  if ((last_p_ - stood_).norm() < kStood) return;
  doubtful_ = false;
  stood_ = last_p_;
  stood_since_ = t;
}

/// While the target is surely in view, what else looks just like it is not the target. One of them
/// a frame is placed.
void Perceiver::Remember(const View& view) {
  if (!track_ || doubtful_ || track_->seen < view.t || track_->hits < kSureHits) return;
  decoys_.Forget(view.t, track_->state.position());
  const size_t n = view.detections.size();
  for (size_t k = 0; k < n; ++k) {
    const size_t i = (k + turn_) % n;
    if (view.taken[i] || view.detections[i].part || !MayBeNew(view.detections[i])) continue;
    turn_ = i + 1;
    const auto found = finder_.Acquire(view, view.detections[i]);
    if (!found || !found->fit.whole) return;
    const Eigen::Vector3d p = found->fit.posterior.position();
    if ((p - track_->state.position()).norm() < config_.state.decoy_radius) return;
    Decoy* decoy = decoys_.Note(p, view.t);
    if (decoy) SwapIfTheOtherDrives(*found, decoy, view.t);
    return;
  }
}

/// The one that drives is the target, and the one that stands is not.
void Perceiver::SwapIfTheOtherDrives(const Sighting& s, Decoy* other, double t) {
  const double sigma = std::sqrt(s.fit.posterior.covariance.topLeftCorner<3, 3>().trace());
  const bool stands =
      t - stood_since_ > kStoodFor && (track_->state.position() - stood_).norm() < kStood;
  if (!stands || !other->driven() || sigma > kDrivenSigma) return;
  const Eigen::Vector3d stood = track_->state.position();
  *other = {stood, stood, t, other->hits};
  Start({s.fit.posterior, s.fit.shape, t, t, 1, 0, s.fit.joined}, s);
}

void Perceiver::ForgetIfTimeRanBack(double t) {
  if (t < last_t_ - kTimeJump) {
    track_.reset();
    candidates_.clear();
    decoys_.Clear();
    state_ = TargetState::kSearching;
  }
  last_t_ = t;
}

TargetEstimate Perceiver::Report(double t, const std::optional<View>& view,
                                 std::string note) const {
  TargetEstimate out;
  out.t = t;
  out.state = state_;
  out.size =
      track_ ? track_->shape.size : Eigen::Vector2d(config_.target_radius, config_.target_height);
  out.note = std::move(note);
  if (sighting_) {
    out.box = sighting_->detection.box;
    out.score = sighting_->detection.score;
    out.n_points = sighting_->n_points;
  }
  out.covariance = kUnknownVariance * Eigen::Matrix3d::Identity();
  if (!track_) return out;
  out.p_WT = track_->state.position();
  out.v_WT = track_->state.velocity();
  if (state_ == TargetState::kLost) return out;
  const auto pose = view ? view->pose : finder_.poses().Nearest(t, 1e9).value_or(PoseSample{});
  out.covariance = PublishedCovariance(*track_, pose, config_.motion);
  return out;
}

TargetEstimate Perceiver::See(const Frame& frame) {
  ForgetIfTimeRanBack(frame.t);
  std::string note;
  auto view = finder_.Look(frame, &note);
  sighting_.reset();
  unsure_.reset();
  if (track_ && state_ != TargetState::kLost) track_->Predict(frame.t, config_.motion);
  for (auto& c : candidates_) c.track.Predict(frame.t, config_.motion);
  if (view) {
    if (state_ != TargetState::kLost) Follow(&*view);
    Seek(&*view);
    if (sighting_ || !candidates_.empty()) finder_.MarkSweepsUsed();
    Remember(*view);
  } else {
    for (auto& c : candidates_) ++c.track.misses;
    DropMissed();
  }
  Judge(frame.t);
  return Report(frame.t, view, std::move(note));
}

}  // namespace chase::perception
