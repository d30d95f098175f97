#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/perception/belief/perceiver.h"

// How the Perceiver looks for its target: what it follows until it is known for it.

namespace chase::perception {

namespace {

constexpr int kConfirmFrames = 2;    // that must agree before a candidate is believed
constexpr int kCandidateMisses = 2;  // frames without it that end it
constexpr size_t kMaxCandidates = 6, kMostLookAlikes = 32;
constexpr double kLeastWidth = 12.0;     // standard deviations of a sharp edge; less may be a slit
constexpr double kPointed = 1.0;         // s that what is pointed at is looked for there
constexpr double kStandingRange = 10.0;  // m, what stands further off is not taken
constexpr double kFar = 5.0;             // m, from where fewer pixels tell what stands there
constexpr double kReachMargin = 0.5;     // m
constexpr double kReachGate = 11.3;  // squared distance from a hidden target's prediction, 3 dof
constexpr double kMemory = 60.0;     // s that a look-alike is remembered

}  // namespace

void Perceiver::FollowCandidates(View* view) {
  for (auto& c : candidates_) {
    const auto again = finder_.Find(c, view);
    if (again && (again->fit.whole || c.partial))
      c.Correct(*again, view->camera.p_WC);
    else
      ++c.misses;
  }
  DropMissed();
}

void Perceiver::DropMissed() {
  candidates_.erase(std::remove_if(candidates_.begin(), candidates_.end(),
                                   [](const Track& c) { return c.misses >= kCandidateMisses; }),
                    candidates_.end());
}

/// Counts why nothing was made of a detection.
void Perceiver::CountRefused(const Detection& d) {
  Refusal why = finder_.HasSweeps() ? Refusal::kContradicted : Refusal::kNoRange;
  if (d.box.width < kLeastWidth * config_.fit.edge_sigma_px)
    why = Refusal::kTooSmall;
  else if (d.score < config_.state.acquire_score)
    why = Refusal::kWrongShape;
  ++refused_[static_cast<size_t>(why)];
}

/// False where a look-alike is remembered, and where a target that is hidden or lost cannot be.
bool Perceiver::MayBeTarget(const Sighting& s, double t) const {
  const Eigen::Vector3d p_WT = s.fit.posterior.position();
  for (const LookAlike& other : look_alikes_)
    if (t - other.t < kMemory && (other.p_W - p_WT).norm() < config_.state.decoy_radius)
      return false;
  if (!track_ || !track_->driven) return true;
  if (state_ == TargetState::kLost)
    return (p_WT - track_->last.fit.posterior.position()).norm() <
           kReachMargin + config_.motion.max_speed * (t - track_->seen);
  const Eigen::Vector3d d = p_WT - track_->state.position();
  const Eigen::Matrix3d P = track_->state.covariance.topLeftCorner<3, 3>();
  return d.dot(P.ldlt().solve(d)) < kReachGate;
}

void Perceiver::AddCandidates(View* view) {
  const bool comes_back = track_ && track_->driven;
  const auto followed = [&](const Eigen::Vector3d& p_W) {
    return std::any_of(candidates_.begin(), candidates_.end(), [&](const Track& c) {
      return (c.state.position() - p_W).norm() < config_.state.decoy_radius;
    });
  };
  for (size_t i = 0; i < view->detections.size() && candidates_.size() < kMaxCandidates; ++i) {
    const Detection& d = view->detections[i];
    if (view->taken[i]) continue;
    const bool shown = d.box.width >= kLeastWidth * config_.fit.edge_sigma_px &&
                       std::max(d.score, d.solidity) >= config_.state.acquire_score;
    const auto found = shown ? finder_.Acquire(*view, d) : std::nullopt;
    // A part of it has another outline: LiDAR must tell its range, and so how much is hidden.
    const bool fits = found && (d.score >= config_.state.acquire_score ||
                                (!found->fit.whole && found->SurelyHit()));
    if (!fits) CountRefused(d);
    if (!fits || !MayBeTarget(*found, view->t)) continue;
    // A piece needs LiDAR points, and so does what shows in part unless the target may come back.
    const bool needs_points = d.part || (!found->fit.whole && !comes_back);
    if ((needs_points && found->fit.n_points == 0) || followed(found->fit.posterior.position()))
      continue;
    candidates_.push_back(StartTrack(*found, view->t, view->camera.p_WC));
  }
}

/// What drives is ready at once, what stands after a while. A target that was seen must have had
/// the time to stop.
bool Perceiver::Ready(const Track& c, double t) const {
  if (c.misses > 0 || c.hits < kConfirmFrames) return false;
  if (c.Drives()) return true;
  if (c.part || c.last.detection.AnyCut()) return false;
  if (c.partial && !(c.last.SurelyHit() && c.Alike())) return false;
  const double wait = config_.state.standing_after * std::max(1.0, std::pow(c.Range() / kFar, 2));
  return !sighted_ && (!track_ || t - track_->seen > kHiddenTime) && c.Range() < kStandingRange &&
         t - c.since >= wait;
}

void Perceiver::Seek(View* view) {
  if (selected_) return TakeSelected(view);
  if (sighted_ && track_->driven) return;
  FollowCandidates(view);
  AddCandidates(view);
  Confirm(*view);
}

void Perceiver::Confirm(const View& view) {
  const auto better = [](const Track& a, const Track& b) {
    return a.Drives() != b.Drives() ? a.Drives() : a.since < b.since;
  };
  const Track* best = nullptr;
  for (const auto& c : candidates_)
    if (Ready(c, view.t) && (!best || better(c, *best))) best = &c;
  if (!best) return;
  Track chosen = *best;
  chosen.driven = chosen.Drives();
  for (const auto& c : candidates_)
    if (&c != best && chosen.driven && !c.Drives() && !c.part && c.hits >= kConfirmFrames)
      look_alikes_.push_back({c.state.position(), view.t});
  if (sighted_) look_alikes_.push_back({track_->state.position(), view.t});
  while (look_alikes_.size() > kMostLookAlikes) look_alikes_.pop_front();
  Start(chosen);
}

/// The detection at the pixel that was pointed at, or nearest to it as things move: within its
/// size.
void Perceiver::TakeSelected(View* view) {
  if (view->t - selected_at_ > kPointed) return selected_.reset();
  const auto off = [&](const Detection& d) {
    const Eigen::Vector2d low(d.box.x, d.box.y), high(d.box.br().x, d.box.br().y);
    return (*selected_ - selected_->cwiseMax(low).cwiseMin(high)).norm();
  };
  const Detection* nearest = nullptr;
  for (const Detection& d : view->detections)
    if (!d.part && off(d) <= d.box.width && (!nearest || off(d) < off(*nearest))) nearest = &d;
  const auto found = nearest ? finder_.Acquire(*view, *nearest) : std::nullopt;
  if (!found) return;
  Start(StartTrack(*found, view->t, view->camera.p_WC));
  track_->driven = true;
  selected_.reset();
}

}  // namespace chase::perception
