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
    const auto again =
        finder_.Find(c.track, view, [&](const Sighting& s) { return s.detection.part && !c.part; });
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
  std::vector<size_t> order;  // near before far, the middle before the border
  for (size_t i = 0; i < view->detections.size(); ++i) {
    if (view->taken[i]) continue;
    if (MayBeNew(view->detections[i]))
      order.push_back(i);
    else
      CountRefused(view->detections[i]);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return Prominence(view->detections[a], config_.rig) >
           Prominence(view->detections[b], config_.rig);
  });
  const bool comes_back = track_ && !tentative_ && track_->Proven();
  for (const size_t i : order) {
    if (candidates_.size() >= kMaxCandidates) return;
    const auto found = finder_.Acquire(*view, view->detections[i]);
    // A part of it has another outline: LiDAR must tell its range, and so how much is hidden.
    const bool fits = found && (found->detection.score >= config_.state.acquire_score ||
                                (!found->fit.whole && found->SurelyHit()));
    if (!fits) CountRefused(view->detections[i]);
    if (!fits || !InGate(*found, view->t)) continue;
    // A piece needs LiDAR points, and so does what shows in part unless the target may come back.
    const bool needs_points = found->detection.part || (!found->fit.whole && !comes_back);
    if ((needs_points && found->fit.n_points == 0) || Followed(*found)) continue;
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
    if (&c != best && drives && !c.Drives() && !c.part && c.track.hits >= Candidate::kConfirmFrames)
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
    if (!d.part && off(d) <= d.box.width && (!nearest || off(d) < off(*nearest))) nearest = &d;
  if (!nearest) return;
  const auto found = finder_.Acquire(*view, *nearest);
  if (!found) return;
  Start(NewCandidate(*found, *view).track, *found);
  view->taken[static_cast<size_t>(nearest - view->detections.data())] = true;
  selected_.reset();
}

}  // namespace chase::perception
