#include "services/perception/perceiver.h"

#include <algorithm>
#include <cmath>

#include "services/perception/image_check.h"
#include "services/perception/silhouette.h"

namespace chase::perception {

namespace {

constexpr size_t kMaxSweeps = 4;
constexpr double kUnknownVariance = 1e4;  // m^2, while nothing is known
constexpr double kBoxMargin = 0.25;       // share of the expected box in which a piece may lie
constexpr double kLarger = 1.3;           // times the expected size: more than the target
constexpr double kBoxMarginPx = 4.0;
constexpr double kGateSigmas = 3.0;
constexpr int kCandidateMisses = 2;   // frames without it that end a candidate
constexpr double kReachMargin = 0.5;  // m
constexpr double kTimeJump = 1.0;     // s back that count as a new recording
constexpr size_t kMaxDecoyFits = 3;   // a frame
constexpr size_t kMaxDecoys = 32;

/// Where in the image the target may be seen, given how well it is known.
std::optional<cv::Rect2d> SearchBox(const TargetTrack& track, const Camera& camera) {
  const auto box =
      ProjectCylinder(camera, track.state.position(), track.shape.size[0], track.shape.size[1]);
  if (!box) return std::nullopt;
  const double range = (track.state.position() - camera.p_WC).norm();
  const double sigma =
      std::sqrt(track.state.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  const double margin = kBoxMarginPx + kGateSigmas * sigma / range * camera.rig.focal_px;
  const double dx = margin + kBoxMargin * box->width, dy = margin + kBoxMargin * box->height;
  return cv::Rect2d(box->x - dx, box->y - dy, box->width + 2 * dx, box->height + 2 * dy);
}

/// The part of a detection that may be the target: where it is larger than the target, a like
/// colour behind goes on outside.
std::optional<Detection> Within(const cv::Rect2d& search, const cv::Rect2d& expected,
                                const cv::Mat& bgr, const Detection& detection) {
  const bool larger = detection.box.width > kLarger * expected.width ||
                      detection.box.height > kLarger * expected.height;
  if (detection.mask.empty() || !larger) return detection;
  const cv::Rect window(
      static_cast<int>(std::floor(search.x)), static_cast<int>(std::floor(search.y)),
      static_cast<int>(std::ceil(search.width)), static_cast<int>(std::ceil(search.height)));
  return CropTo(bgr, detection, window);
}

}  // namespace

Perceiver::Perceiver(const PerceptionConfig& config)
    : config_(config),
      detector_(MakeDetector(config.detector, config.fit.edge_sigma_px, config.rig)),
      localiser_(config) {
  const double variance = config.fit.shape_sigma * config.fit.shape_sigma;
  shape_.size = {config.target_radius, config.target_height};
  shape_.variance = {variance, variance};
}

void Perceiver::AddSweep(Sweep sweep) {
  if (!sweeps_.empty() && sweep.t < sweeps_.back().sweep.t - kTimeJump) sweeps_.clear();
  sweeps_.push_back({std::move(sweep), false});
  if (sweeps_.size() > kMaxSweeps) sweeps_.pop_front();
}

std::optional<Perceiver::View> Perceiver::Look(const Frame& frame, std::string* note) const {
  *note = frame.problem.empty() ? ImageProblem(frame.bgr, config_.rig) : frame.problem;
  if (!note->empty()) return std::nullopt;
  const auto pose = poses_.At(frame.t, config_.max_extrapolation);
  if (!pose) {
    *note = poses_.Nearest(frame.t, config_.max_pose_age) ? "the pose is too old" : "no pose";
    return std::nullopt;
  }
  View view{frame.t, *pose, CameraAt(*pose, config_.rig), frame.bgr, {}, {}};
  view.detections = detector_->Detect(frame.bgr);
  view.taken.assign(view.detections.size(), false);
  return view;
}

Clusters Perceiver::Points(const View& view, const Detection& detection,
                           const Eigen::Vector3d& v_WT, bool fresh_only) const {
  Clusters all;
  for (auto it = sweeps_.rbegin(); it != sweeps_.rend(); ++it) {
    if ((fresh_only && it->used) || view.t - it->sweep.t > config_.max_sweep_age) continue;
    if (it->sweep.t > view.t) continue;
    Clusters clusters = SelectPoints(it->sweep, poses_, view.camera, view.t, detection, v_WT);
    for (auto& c : clusters) all.push_back(std::move(c));
    if (!fresh_only) break;  // only the newest
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.front().range < b.front().range; });
  return all;
}

std::optional<Perceiver::Sighting> Perceiver::Try(const TargetTrack& track, const View& view,
                                                  const Detection& detection,
                                                  bool fresh_sweeps_only) const {
  FitInput input;
  input.prior = track.state;
  input.shape = track.shape;
  input.camera = view.camera;
  input.detection = &detection;
  const auto fit =
      localiser_.Correct(input, Points(view, detection, track.state.velocity(), fresh_sweeps_only));
  if (!fit) return std::nullopt;
  return Sighting{*fit, detection, fit->n_points};
}

std::optional<Perceiver::Sighting> Perceiver::Find(const TargetTrack& track, View* view,
                                                   bool fresh_sweeps_only) {
  const auto expected = ProjectCylinder(view->camera, track.state.position(), track.shape.size[0],
                                        track.shape.size[1]);
  if (!expected) return std::nullopt;
  const auto search = SearchBox(track, view->camera);
  if (!search) return std::nullopt;
  std::vector<size_t> inside;
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && (view->detections[i].box & *search).area() > 0.0) inside.push_back(i);
  std::optional<Sighting> best;
  for (const size_t i : inside) {
    const auto piece = Within(*search, *expected, view->bgr, view->detections[i]);
    if (!piece) continue;
    const auto s = Try(track, *view, *piece, fresh_sweeps_only);
    if (s && IsDecoy(s->fit.posterior.position())) continue;
    if (s && (!best || s->fit.cost < best->fit.cost)) best = s;
  }
  if (!best && inside.size() >= 2 &&
      inside.size() <= 4) {  // pieces of one, parted by what hides it
    std::vector<Detection> pieces;
    for (const size_t i : inside)
      if (!view->detections[i].mask.empty()) pieces.push_back(view->detections[i]);
    if (pieces.size() >= 2) best = Try(track, *view, Merge(view->bgr, pieces), fresh_sweeps_only);
  }
  if (best)
    for (const size_t i : inside)
      view->taken[i] =
          view->taken[i] || (view->detections[i].box & best->detection.box).area() > 0.0;
  return best;
}

std::optional<Perceiver::Sighting> Perceiver::AcquireFrom(const View& view,
                                                          const Detection& detection) const {
  const auto fit = localiser_.Acquire(shape_, view.camera, detection,
                                      Points(view, detection, Eigen::Vector3d::Zero(), false));
  if (!fit) return std::nullopt;
  return Sighting{*fit, detection, fit->n_points};
}

bool Perceiver::IsDecoy(const Eigen::Vector3d& p_WT) const {
  return std::any_of(decoys_.begin(), decoys_.end(), [&](const Decoy& d) {
    return (d.p_W - p_WT).norm() < config_.state.decoy_radius;
  });
}

bool Perceiver::Plausible(const Eigen::Vector3d& p_WT, double t) const {
  if (IsDecoy(p_WT)) return false;
  if (!track_) return true;
  const double reach = kReachMargin + config_.motion.max_speed * (t - track_->seen);
  return (p_WT - track_->state.position()).norm() < reach;
}

void Perceiver::Follow(View* view) {
  if (!track_) return;
  sighting_ = Find(*track_, view, true);
  if (!sighting_) {
    ++track_->misses;
    return;
  }
  track_->Correct(sighting_->fit);
  for (auto& s : sweeps_) s.used = true;
  candidate_.reset();
}

void Perceiver::Seek(View* view) {
  if (sighting_) return;
  if (candidate_) {
    const auto again = Find(*candidate_, view, true);
    if (again) {
      candidate_->Correct(again->fit);
      for (auto& s : sweeps_) s.used = true;
      sighting_ = again;
      return;
    }
    if (++candidate_->misses >= kCandidateMisses) candidate_.reset();
    return;
  }
  for (size_t i = 0; i < view->detections.size(); ++i) {
    const Detection& d = view->detections[i];
    if (view->taken[i] || d.score < config_.state.acquire_score) continue;
    const auto found = AcquireFrom(*view, d);
    if (!found || !Plausible(found->fit.posterior.position(), view->t)) continue;
    candidate_ = TargetTrack{found->fit.posterior, found->fit.shape, view->t, view->t, 1, 0};
    sighting_ = found;
    for (auto& s : sweeps_) s.used = true;
    return;
  }
}

void Perceiver::Promote(double) {
  if (!candidate_ || candidate_->hits < config_.state.confirm_frames) return;
  track_ = candidate_;
  candidate_.reset();
  state_ = TargetState::kTracking;
}

void Perceiver::Judge(double t) {
  if (!track_) return;
  const double unseen = t - track_->seen;
  const double sigma =
      std::sqrt(track_->state.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
  if (unseen < config_.state.hidden_after)
    state_ = TargetState::kTracking;
  else if (state_ != TargetState::kLost)
    state_ = unseen > config_.state.lost_after || sigma > config_.state.lost_sigma
                 ? TargetState::kLost
                 : TargetState::kOccluded;
}

/// While the target is in view, what else looks just like it is not the target.
void Perceiver::Remember(const View& view) {
  if (!track_ || track_->seen < view.t) return;
  decoys_.erase(std::remove_if(decoys_.begin(), decoys_.end(),
                               [&](const Decoy& d) {
                                 return view.t - d.t > config_.state.decoy_memory ||
                                        (d.p_W - track_->state.position()).norm() <
                                            config_.state.decoy_radius;
                               }),
                decoys_.end());
  size_t fits = 0;
  for (size_t i = 0; i < view.detections.size() && fits < kMaxDecoyFits; ++i) {
    if (view.taken[i] || view.detections[i].score < config_.state.acquire_score) continue;
    ++fits;
    const auto found = AcquireFrom(view, view.detections[i]);
    if (!found) continue;
    const Eigen::Vector3d p = found->fit.posterior.position();
    if ((p - track_->state.position()).norm() < config_.state.decoy_radius) continue;
    const auto known = std::find_if(decoys_.begin(), decoys_.end(), [&](const Decoy& d) {
      return (d.p_W - p).norm() < config_.state.decoy_radius;
    });
    if (known != decoys_.end())
      *known = {p, view.t};
    else if (decoys_.size() < kMaxDecoys)
      decoys_.push_back({p, view.t});
  }
}

void Perceiver::ForgetIfTimeRanBack(double t) {
  if (t < last_t_ - kTimeJump) {
    track_.reset();
    candidate_.reset();
    decoys_.clear();
    state_ = TargetState::kSearching;
  }
  last_t_ = t;
}

TargetEstimate Perceiver::Report(double t, const std::optional<View>& view,
                                 std::string note) const {
  TargetEstimate out;
  out.t = t;
  out.state = state_;
  out.size = track_ ? track_->shape.size : shape_.size;
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
  const auto pose = view ? view->pose : poses_.Nearest(t, 1e9).value_or(PoseSample{});
  out.covariance = PublishedCovariance(*track_, pose, config_.motion);
  return out;
}

TargetEstimate Perceiver::See(const Frame& frame) {
  ForgetIfTimeRanBack(frame.t);
  std::string note;
  auto view = Look(frame, &note);
  sighting_.reset();
  if (track_ && state_ != TargetState::kLost) track_->Predict(frame.t, config_.motion);
  if (candidate_) candidate_->Predict(frame.t, config_.motion);
  if (view) {
    if (state_ != TargetState::kLost) Follow(&*view);
    Seek(&*view);
    Promote(frame.t);
    Remember(*view);
  } else if (candidate_ && ++candidate_->misses >= kCandidateMisses) {
    candidate_.reset();
  }
  Judge(frame.t);
  return Report(frame.t, view, std::move(note));
}

}  // namespace chase::perception
