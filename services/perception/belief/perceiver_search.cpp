#include <algorithm>
#include <cmath>

#include "services/perception/belief/perceiver.h"

// How the Perceiver looks for its target: what it follows until it is known for it.

namespace chase::perception {

namespace {

constexpr int kCandidateMisses = 2;  // frames without it that end a candidate
constexpr size_t kMaxCandidates = 6, kMostLookAlikes = 32;
constexpr double kLeastWidth = 12.0;  // standard deviations of a sharp edge; less may be a slit
constexpr double kPointed = 1.0;      // s that what is pointed at is looked for there

}  // namespace

void Perceiver::FollowCandidates(View* view) {
  for (auto& c : candidates_) {
    const auto again = finder_.Find(c.track, view);
    if (!again || !(again->fit.whole || c.track.partial)) {
      ++c.track.misses;
      continue;
    }
    c.Correct(*again, view->camera.p_WC);
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
  return std::max(d.score, d.solidity) >= config_.state.acquire_score &&
         d.box.width >= kLeastWidth * config_.fit.edge_sigma_px;
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

/// True when a candidate is followed there.
bool Perceiver::Followed(const Sighting& s) const {
  return std::any_of(candidates_.begin(), candidates_.end(), [&](const Candidate& c) {
    return (c.track.state.position() - s.fit.posterior.position()).norm() <
           config_.state.decoy_radius;
  });
}

void Perceiver::AddCandidates(View* view) {
  const bool comes_back = track_ && !tentative_ && track_->Proven();
  for (size_t i = 0; i < view->detections.size() && candidates_.size() < kMaxCandidates; ++i) {
    if (view->taken[i]) continue;
    const Detection& d = view->detections[i];
    const auto found = MayBeNew(d) ? finder_.Acquire(*view, d) : std::nullopt;
    // A part of it has another outline: LiDAR must tell its range, and so how much is hidden.
    const bool fits = found && (d.score >= config_.state.acquire_score ||
                                (!found->fit.whole && found->SurelyHit()));
    if (!fits) CountRefused(d);
    if (!fits || !InGate(*found, view->t) || Followed(*found)) continue;
    // What shows in part needs LiDAR points, unless the target may come back.
    if (found->fit.whole || found->fit.n_points > 0 || comes_back)
      candidates_.push_back(NewCandidate(*found, *view));
  }
}

void Perceiver::Seek(View* view) {
  if (selected_) return TakeSelected(view);
  if (sighting_ && !tentative_) return;
  FollowCandidates(view);
  AddCandidates(view);
  Confirm(*view);
}

void Perceiver::Confirm(const View& view) {
  const auto better = [](const Candidate& a, const Candidate& b) {
    return a.Drives() != b.Drives() ? a.Drives() : a.since < b.since;
  };
  const Candidate* best = nullptr;
  for (const auto& c : candidates_)
    if (Ready(c, view.t) && (!best || better(c, *best))) best = &c;
  if (!best) return;
  const Candidate chosen = *best;
  const bool drives = chosen.Drives() || PieceIsReady(chosen);
  for (const auto& c : candidates_)
    if (&c != best && drives && !c.Drives() && c.track.hits >= Candidate::kConfirmFrames)
      look_alikes_.push_back({c.track.state.position(), view.t});
  if (sighting_) look_alikes_.push_back({track_->state.position(), view.t});
  while (look_alikes_.size() > kMostLookAlikes) look_alikes_.pop_front();
  Start(chosen.track, chosen.last);
  tentative_ = !drives;
  candidates_.clear();
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
    if (off(d) <= d.box.width && (!nearest || off(d) < off(*nearest))) nearest = &d;
  if (!nearest) return;
  const auto found = finder_.Acquire(*view, *nearest);
  if (!found) return;
  Start(NewCandidate(*found, *view).track, *found);
  view->taken[static_cast<size_t>(nearest - view->detections.data())] = true;
  selected_.reset();
}

}  // namespace chase::perception
