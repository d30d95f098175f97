#include "services/perception/belief/perceiver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kHiddenAfter = 0.08;     // s unseen: occluded
constexpr double kLostSigma = 3.0;        // m, horizontal standard deviation of what is lost
constexpr double kUnknownVariance = 1e4;  // m^2, while nothing is known
constexpr double kExpectedGate = 4.6;     // squared distance from a hidden target's prediction
constexpr double kThere = 0.5;            // m, within which a target is where it is said to be

}  // namespace

/// As of a circle in the plan view, with the ellipse's area.
double TargetEstimate::Existence() const {
  if (state != TargetState::kTracking && state != TargetState::kOccluded) return 0.0;
  const double variance = std::sqrt(covariance.topLeftCorner<2, 2>().determinant());
  return 1.0 - std::exp(-0.5 * kThere * kThere / variance);
}

Perceiver::Perceiver(const PerceptionConfig& config) : config_(config), finder_(config) {}

/// True where the target was expected; what is not hidden is asked for by its fit alone.
bool Perceiver::Expected(const Sighting& s) const {
  if (track_->misses == 0) return true;
  const Eigen::Vector2d off = (s.fit.posterior.position() - track_->state.position()).head<2>();
  const Eigen::Matrix2d P = track_->state.covariance.topLeftCorner<2, 2>();
  return off.norm() < config_.state.decoy_radius || off.dot(P.ldlt().solve(off)) < kExpectedGate;
}

void Perceiver::Follow(View* view) {
  if (!track_ || state_ == TargetState::kLost) return;
  const auto taken = view->taken;
  const auto found = finder_.Find(*track_, view);
  sighted_ = found && Expected(*found);
  if (!sighted_) {
    view->taken = taken;
    ++track_->misses;
    return;
  }
  track_->Correct(*found, view->camera.p_WC);
  if (track_->driven) candidates_.clear();
}

void Perceiver::Start(const Track& track) {
  track_ = track;
  sighted_ = true;
  state_ = TargetState::kTracking;
  candidates_.clear();
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
  out.size = {config_.target_radius, config_.target_height};
  out.note = std::move(note);
  out.refused = refused_;
  out.covariance = out.velocity_covariance = kUnknownVariance * Eigen::Matrix3d::Identity();
  if (!track_) return out;
  if (sighted_) {
    out.box = track_->last.detection.box;
    out.score = track_->last.detection.score;
    out.n_points = track_->last.fit.n_points;
  }
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
  sighted_ = false;
  refused_ = {};
  if (track_ && state_ != TargetState::kLost) track_->Predict(frame.t, config_.motion);
  for (auto& c : candidates_) c.Predict(frame.t, config_.motion);
  if (view) {
    Follow(&*view);
    Seek(&*view);
    if (sighted_ || !candidates_.empty()) finder_.MarkSweepsUsed(frame.t);
  } else if (newer) {
    if (track_) ++track_->misses;
    for (auto& c : candidates_) ++c.misses;
    DropMissed();
  }
  if (newer) Judge(frame.t);
  return Report(frame.t, view, std::move(note));
}

}  // namespace chase::perception
