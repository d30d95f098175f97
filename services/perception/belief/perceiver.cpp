#include "services/perception/belief/perceiver.h"

#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kHiddenAfter = 0.08;     // s unseen: occluded
constexpr double kLostSigma = 3.0;        // m, horizontal standard deviation of what is lost
constexpr double kUnknownVariance = 1e4;  // m^2, while nothing is known
constexpr double kGap = 0.25;             // s between frames in which a target may do anything
constexpr double kThere = 0.5;            // m, within which a target is where it is said to be
constexpr double kStood = 0.2;            // m, within which a target stands

}  // namespace

/// As of a circle in the plan view, with the ellipse's area.
double TargetEstimate::Existence() const {
  if (state != TargetState::kTracking && state != TargetState::kOccluded) return 0.0;
  const double variance = std::sqrt(covariance.topLeftCorner<2, 2>().determinant());
  return 1.0 - std::exp(-0.5 * kThere * kThere / variance);
}

Perceiver::Perceiver(const PerceptionConfig& config) : config_(config), finder_(config) {}

void Perceiver::Follow(View* view) {
  if (!track_) return;
  auto taken = view->taken;
  const auto found = finder_.Find(*track_, view, [](const Sighting&) { return false; });
  if (!found || !Sure(*found)) {
    view->taken = taken;
    ++track_->misses;
    return;
  }
  sighting_ = found;
  track_->Correct(found->fit);
  if (!tentative_) candidates_.clear();
}

void Perceiver::Start(const TargetTrack& track, const Sighting& sighting) {
  track_ = track;
  tentative_ = false;
  stood_ = track.state.position();
  sighting_ = sighting;
  state_ = TargetState::kTracking;
}

void Perceiver::Judge(double t) {
  if (!track_) return;
  const double unseen = t - track_->seen;
  if (unseen < kHiddenAfter)
    state_ = TargetState::kTracking;
  else if (state_ != TargetState::kLost)
    state_ = unseen > config_.state.lost_after || track_->HorizontalSigma() > kLostSigma
                 ? TargetState::kLost
                 : TargetState::kOccluded;
  if (unseen > 0.0) return;
  last_p_ = track_->state.position();
  if ((last_p_ - stood_).norm() < kStood) return;
  tentative_ = false;
  stood_ = last_p_;
}

/// True when the frame is newer than the last one, or starts a recording anew.
bool Perceiver::ForgetIfTimeRanBack(double t) {
  const bool jumped = t < last_t_ - PoseHistory::kSpan;
  if (!jumped && t <= last_t_) return false;
  last_t_ = t;
  if (jumped) Forget();
  return true;
}

void Perceiver::Forget() {
  track_.reset();
  candidates_.clear();
  look_alikes_.clear();
  selected_.reset();
  state_ = TargetState::kSearching;
}

void Perceiver::Select(const DetectorConfig& detector, const Eigen::Vector2d& at) {
  config_.detector = detector;
  finder_.SetDetector(detector);
  Forget();
  selected_ = at;
  selected_at_ = last_t_;
}

TargetEstimate Perceiver::Report(double t, const std::optional<View>& view,
                                 std::string note) const {
  TargetEstimate out;
  out.state = state_;
  out.size =
      track_ ? track_->shape.size : Eigen::Vector2d(config_.target_radius, config_.target_height);
  out.note = std::move(note);
  out.refused = refused_;
  if (sighting_) {
    out.box = sighting_->detection.box;
    out.score = sighting_->detection.score;
    out.n_points = sighting_->fit.n_points;
  }
  out.covariance = out.velocity_covariance = kUnknownVariance * Eigen::Matrix3d::Identity();
  if (!track_) return out;
  out.p_WT = track_->state.position();
  out.v_WT = track_->state.velocity();
  out.unseen = std::max(0.0, t - track_->seen);
  if (state_ == TargetState::kLost) return out;
  out.velocity_covariance = track_->state.covariance.bottomRightCorner<3, 3>();
  const auto pose = view ? view->pose : finder_.poses().Nearest(t, 1e9).value_or(PoseSample{});
  out.covariance =
      PublishedCovariance(*track_, pose, config_.detector.shape.outline_sigma, config_.motion);
  return out;
}

TargetEstimate Perceiver::See(const Frame& frame) {
  const bool newer = ForgetIfTimeRanBack(frame.t);
  std::string note;
  auto view = finder_.Look(frame, &note);
  if (view && !newer) {
    view.reset();
    note = "the frame is not newer than the last one";
  }
  sighting_.reset();
  refused_ = {};
  if (track_ && frame.t - track_->seen > kGap) track_->misses = std::max(1, track_->misses);
  if (track_ && state_ != TargetState::kLost) track_->Predict(frame.t, config_.motion);
  for (auto& c : candidates_) c.track.Predict(frame.t, config_.motion);
  if (view) {
    if (state_ != TargetState::kLost) Follow(&*view);
    Seek(&*view);
    if (sighting_ || !candidates_.empty()) finder_.MarkSweepsUsed(frame.t);
  } else if (newer) {
    if (track_) ++track_->misses;
    for (auto& c : candidates_) ++c.track.misses;
    DropMissed();
  }
  if (newer) Judge(frame.t);
  return Report(frame.t, view, std::move(note));
}

}  // namespace chase::perception
