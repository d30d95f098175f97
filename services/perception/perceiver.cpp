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
constexpr double kLarger = 1.1;           // times the expected size: more than the target
constexpr double kTrimPx = 2.0;           // left around the expected box of what is larger
constexpr double kBoxMarginPx = 4.0;
constexpr double kGateSigmas = 3.0;
constexpr double kOdds = 0.0;           // logarithm of the odds that a sighting needs,
constexpr double kOddsAfterMiss = 1.5;  // and where the frame before had none
constexpr double kSureOdds = 8.0;       // and with which no other is tried
constexpr size_t kMostTried = 4;        // detections a track and frame
constexpr int kCandidateMisses = 2;     // frames without it that end a candidate
constexpr double kReachMargin = 0.5;    // m
constexpr double kReachGate = 9.0;      // squared distance from a hidden target's prediction, 3 dof
constexpr double kTimeJump = 1.0;       // s back that count as a new recording
constexpr int kSureHits = 5;            // corrections after which the track is trusted
constexpr int kDecoyHits = 3;           // sightings that make a look-alike
constexpr double kDecoySigma = 0.1;     // m, how well its place is known
constexpr double kDriven = 0.4, kStood = 0.2;  // m, from where first seen
constexpr double kDrivenSigma = 0.1;           // m, how well that must be known
constexpr size_t kMaxDecoys = 32;

/// Where in the image the target may be seen, given how well it is known.
struct SearchBoxes {
  cv::Rect2d expected;  ///< the target's own
  cv::Rect2d search;    ///< pieces of it may lie here
  cv::Rect2d trim;      ///< all of it lies here
};

cv::Rect2d Grown(const cv::Rect2d& box, double dx, double dy) {
  return {box.x - dx, box.y - dy, box.width + 2 * dx, box.height + 2 * dy};
}

std::optional<SearchBoxes> WhereToLook(const TargetTrack& track, const Camera& camera) {
  const auto box =
      ProjectCylinder(camera, track.state.position(), track.shape.size[0], track.shape.size[1]);
  if (!box) return std::nullopt;
  const double range = (track.state.position() - camera.p_WC).norm();
  const double sigma =
      std::sqrt(track.state.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  const double spread = kGateSigmas * sigma / range * camera.rig.focal_px;
  const double margin = kBoxMarginPx + spread;
  return SearchBoxes{
      *box, Grown(*box, margin + kBoxMargin * box->width, margin + kBoxMargin * box->height),
      Grown(*box, kTrimPx + spread, kTrimPx + spread)};
}

/// The part of a detection that may be the target: where it is larger than the target, a like
/// colour behind goes on outside.
std::optional<Detection> Within(const SearchBoxes& boxes, const cv::Mat& bgr,
                                const Detection& detection) {
  const bool larger = detection.box.width > kLarger * boxes.expected.width + kTrimPx ||
                      detection.box.height > kLarger * boxes.expected.height + kTrimPx;
  if (detection.mask.empty() || !larger) return detection;
  const cv::Rect2d& trim = boxes.trim;
  const cv::Rect window(static_cast<int>(std::floor(trim.x)), static_cast<int>(std::floor(trim.y)),
                        static_cast<int>(std::ceil(trim.width)),
                        static_cast<int>(std::ceil(trim.height)));
  return CropTo(bgr, detection, window);
}

/// 1 for the size that is expected in the middle of where it is expected, less for all else.
double Likeness(const cv::Rect2d& box, const SearchBoxes& boxes) {
  const auto alike = [](double a, double b) { return std::min(a, b) / std::max({a, b, 1.0}); };
  const auto beside = [](double a, double width, double b, double wanted, double reach) {
    return std::abs(a + 0.5 * width - b - 0.5 * wanted) / std::max(1.0, reach);
  };
  const cv::Rect2d &e = boxes.expected, &s = boxes.search;
  const double off = std::hypot(beside(box.x, box.width, e.x, e.width, s.width),
                                beside(box.y, box.height, e.y, e.height, s.height));
  return alike(box.width, e.width) * alike(box.height, e.height) / (1.0 + off);
}

/// Height in the image, counted less towards the sides.
double Prominence(const Detection& d, const world::Rig& rig) {
  const double aside = (d.box.x + 0.5 * d.box.width - rig.center_u_px) / (0.5 * rig.width_px);
  return d.box.height * std::exp(-aside * aside);
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
  if (!fit || fit->log_odds < (track.misses > 0 ? kOddsAfterMiss : kOdds)) return std::nullopt;
  return Sighting{*fit, detection, fit->n_points};
}

std::optional<Perceiver::Sighting> Perceiver::Find(const TargetTrack& track, View* view,
                                                   bool fresh_sweeps_only) {
  const auto boxes = WhereToLook(track, view->camera);
  if (!boxes) return std::nullopt;
  std::vector<size_t> inside;
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && (view->detections[i].box & boxes->search).area() > 0.0)
      inside.push_back(i);
  std::stable_sort(inside.begin(), inside.end(), [&](size_t a, size_t b) {
    return Likeness(view->detections[a].box, *boxes) > Likeness(view->detections[b].box, *boxes);
  });
  if (inside.size() > kMostTried) inside.resize(kMostTried);
  std::optional<Sighting> best;
  std::vector<cv::Rect> tried;
  for (const size_t i : inside) {
    const auto piece = Within(*boxes, view->bgr, view->detections[i]);
    if (!piece || std::count(tried.begin(), tried.end(), piece->mask_box) > 0) continue;
    tried.push_back(piece->mask_box);
    const auto s = Try(track, *view, *piece, fresh_sweeps_only);
    if (s && IsRatherDecoy(*s, *view, *piece)) continue;
    if (s && (!best || s->fit.log_odds > best->fit.log_odds)) best = s;
    if (best && best->fit.whole && best->fit.log_odds > kSureOdds) break;
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

const Perceiver::Decoy* Perceiver::DecoyAt(const Eigen::Vector3d& p_WT) const {
  for (const Decoy& d : decoys_)
    if (d.hits >= kDecoyHits && (d.p_W - p_WT).norm() < config_.state.decoy_radius) return &d;
  return nullptr;
}

/// True when a look-alike known to stand there explains a sighting better than the target does.
bool Perceiver::IsRatherDecoy(const Sighting& s, const View& view,
                              const Detection& detection) const {
  const Decoy* decoy = DecoyAt(s.fit.posterior.position());
  if (!decoy) return false;
  TargetTrack standing{s.fit.posterior, s.fit.shape, view.t, view.t, 1, 0};
  standing.state.mean << decoy->p_W, Eigen::Vector3d::Zero();
  standing.state.covariance = Matrix6d::Identity() * kDecoySigma * kDecoySigma;
  const auto other = Try(standing, view, detection, false);
  return other && other->fit.log_odds > s.fit.log_odds;
}

bool Perceiver::Plausible(const Eigen::Vector3d& p_WT, double t) const {
  if (DecoyAt(p_WT)) return false;
  if (!track_) return true;
  const Eigen::Vector3d d = p_WT - track_->state.position();
  if (std::abs(d.z()) > kGateSigmas * config_.motion.ground_sigma) return false;
  if (state_ != TargetState::kLost)
    return d.dot(track_->state.covariance.topLeftCorner<3, 3>().ldlt().solve(d)) < kReachGate;
  return d.norm() < kReachMargin + config_.motion.max_speed * (t - track_->seen);
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
    if (again && again->fit.whole) {
      candidate_->Correct(again->fit);
      for (auto& s : sweeps_) s.used = true;
      sighting_ = again;
      return;
    }
    if (++candidate_->misses >= kCandidateMisses) candidate_.reset();
    return;
  }
  std::vector<size_t> order;  // near before far, the middle before the border
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && view->detections[i].score >= config_.state.acquire_score)
      order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return Prominence(view->detections[a], config_.rig) >
           Prominence(view->detections[b], config_.rig);
  });
  for (const size_t i : order) {
    const auto found = AcquireFrom(*view, view->detections[i]);
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
  start_ = track_->state.position();
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

/// While the target is surely in view, what else looks just like it is not the target. One of them
/// a frame is placed.
void Perceiver::Remember(const View& view) {
  if (!track_ || track_->seen < view.t || track_->hits < kSureHits) return;
  const auto is_target = [&](const Eigen::Vector3d& p) {
    return (p - track_->state.position()).norm() < config_.state.decoy_radius;
  };
  decoys_.erase(std::remove_if(decoys_.begin(), decoys_.end(),
                               [&](const Decoy& d) {
                                 return view.t - d.t > config_.state.decoy_memory ||
                                        is_target(d.p_W);
                               }),
                decoys_.end());
  const size_t n = view.detections.size();
  for (size_t k = 0; k < n; ++k) {
    const size_t i = (k + turn_) % n;
    if (view.taken[i] || view.detections[i].score < config_.state.acquire_score) continue;
    turn_ = i + 1;
    const auto found = AcquireFrom(view, view.detections[i]);
    if (found && !is_target(found->fit.posterior.position())) NoteDecoy(*found, view.t);
    return;
  }
}

void Perceiver::NoteDecoy(const Sighting& s, double t) {
  const Eigen::Vector3d p = s.fit.posterior.position();
  const auto known = std::find_if(decoys_.begin(), decoys_.end(), [&](const Decoy& d) {
    return (d.p_W - p).norm() < config_.state.decoy_radius;
  });
  if (known == decoys_.end()) {
    if (decoys_.size() < kMaxDecoys) decoys_.push_back({p, p, t, 1});
    return;
  }
  known->p_W = p;
  known->t = t;
  ++known->hits;
  // The one that drives is the target, and the one that stands is not.
  const double sigma = std::sqrt(s.fit.posterior.covariance.topLeftCorner<3, 3>().trace());
  const bool drives =
      (p - known->start).norm() > kDriven && known->hits >= kDecoyHits && sigma < kDrivenSigma;
  const bool stands = (track_->state.position() - start_).norm() < kStood;
  if (!drives || !stands) return;
  const Eigen::Vector3d stood = track_->state.position();
  track_ = TargetTrack{s.fit.posterior, s.fit.shape, t, t, 1, 0};
  start_ = p;
  sighting_ = s;
  *known = {stood, stood, t, kDecoyHits};
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
