#include "services/perception/belief/finder.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/sensors/image_check.h"
#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr size_t kMaxSweeps = 4;
constexpr double kOdds = 0.0;      // logarithm of the odds that a sighting needs,
constexpr int kStillJoined = 2;    // frames without it after which a like colour may have gone
constexpr double kSureOdds = 8.0;  // and with which no other is tried
constexpr size_t kMostTried = 4;   // detections a track and frame
constexpr int kKnownHits = 10;     // sightings after which a track's range is trusted
constexpr double kMaxExtrapolation = 0.05;  // s that the nearest pose is carried to a frame
constexpr double kMaxPoseAge = 0.2;   // s; with a pose this near it is too old, else there is none
constexpr double kMaxSweepAge = 0.3;  // s; older points are not used

bool Overlap(const Detection& a, const Detection& b) { return (a.box & b.box).area() > 0.0; }

}  // namespace

bool Sighting::AllSeen() const {
  const auto& used = fit.used;
  const bool all = std::all_of(used.begin(), used.end(), [](bool side) { return side; });
  return fit.whole && (all || detection.p_CT);
}

Finder::Finder(const PerceptionConfig& config)
    : config_(config),
      detector_(MakeDetector(config.detector, config.fit.edge_sigma_px, config.rig)),
      localiser_(config),
      shape_(ShapeOf(config)) {}

void Finder::SetDetector(const DetectorConfig& detector) {
  config_.detector = detector;
  detector_ = MakeDetector(detector, config_.fit.edge_sigma_px, config_.rig);
  localiser_ = Localiser(config_);
}

void Finder::AddSweep(const Sweep& sweep) {
  if (!sweeps_.empty() && sweep.t < sweeps_.back().sweep.t - PoseHistory::kSpan) sweeps_.clear();
  sweeps_.push_back({sweep, false});
  if (sweeps_.size() > kMaxSweeps) sweeps_.pop_front();
}

void Finder::MarkSweepsUsed(double t) {
  for (auto& s : sweeps_) s.used = s.used || s.sweep.t <= t;
}

std::optional<View> Finder::Look(const Frame& frame, std::string* note) const {
  *note = frame.problem.empty() ? ImageProblem(frame.bgr, config_.rig) : frame.problem;
  if (!note->empty()) return std::nullopt;
  const auto pose = poses_.At(frame.t, kMaxExtrapolation);
  if (!pose) {
    *note = poses_.Nearest(frame.t, kMaxPoseAge) ? "the pose is too old" : "no pose";
    return std::nullopt;
  }
  View view{frame.t, *pose, CameraAt(*pose, config_.rig), frame.bgr, {}, {}};
  view.detections = detector_->Detect(frame.bgr);
  view.taken.assign(view.detections.size(), false);
  return view;
}

Clusters Finder::Points(const View& view, const Detection& detection, const Eigen::Vector3d& v_WT,
                        bool fresh_only) const {
  Clusters all;
  for (auto it = sweeps_.rbegin(); it != sweeps_.rend(); ++it) {
    if ((fresh_only && it->used) || view.t - it->sweep.t > kMaxSweepAge) continue;
    if (it->sweep.t > view.t) continue;
    Clusters clusters = SelectPoints(it->sweep, poses_, view.camera, view.t, detection, v_WT);
    for (auto& c : clusters) all.push_back(std::move(c));
    if (!fresh_only) break;  // only the newest
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.front().range < b.front().range; });
  return all;
}

/// What is hidden has something before it: rays that see free space there tell against it.
void Finder::WeighHidden(const View& view, FitInput input, FitResult* fit) const {
  const auto box = ProjectTarget(view.camera, fit->posterior.position(), fit->shape);
  if (fit->whole || !box) return;
  Detection expected;
  expected.box = *box;
  const Clusters hits = Points(view, expected, fit->posterior.velocity(), false);
  input.hits = &hits;
  fit->log_odds += LogSeenThrough(input, fit->posterior);
}

std::optional<Sighting> Finder::Try(const TargetTrack& track, const View& view,
                                    const Detection& detection, bool fresh_sweeps_only) const {
  FitInput input;
  input.prior = track.state;
  input.shape = track.shape;
  input.camera = view.camera;
  input.detection = &detection;
  input.reappears = track.misses > 0 || track.partial;
  input.joined = track.joined && track.misses <= kStillJoined;
  auto fit =
      localiser_.Correct(input, Points(view, detection, track.state.velocity(), fresh_sweeps_only));
  if (fit) WeighHidden(view, input, &*fit);
  if (!fit || fit->log_odds < kOdds) return std::nullopt;
  // What is hardly known has its range from the size alone; a sweep that was used still tells.
  if (fit->n_points == 0 && fresh_sweeps_only && (track.hits < kKnownHits || track.partial)) {
    FitInput placed = input;
    placed.prior = fit->posterior;
    const auto points = [&](const Eigen::Vector3d& v) { return Points(view, detection, v, false); };
    if (SeenThrough(placed, points(track.state.velocity()))) return std::nullopt;
    if (track.partial && HitElsewhere(placed, points(Eigen::Vector3d::Zero()))) return std::nullopt;
  }
  return Sighting{*fit, detection};
}

std::optional<Sighting> Finder::Best(const TargetTrack& track, const View& view,
                                     const std::vector<size_t>& inside, const Refuses& refuses,
                                     const SearchBoxes& boxes) const {
  std::vector<Sighting> found;
  std::vector<cv::Rect> tried;
  for (const size_t i : inside) {
    const auto piece = Within(boxes, view.bgr, view.detections[i]);
    if (!piece || std::count(tried.begin(), tried.end(), piece->mask_box) > 0) continue;
    tried.push_back(piece->mask_box);
    const auto s = Try(track, view, *piece, true);
    if (!s || refuses(*s)) continue;
    found.push_back(*s);
    if (track.misses == 0 && s->fit.whole && s->fit.log_odds > kSureOdds) break;
  }
  if (found.empty()) return std::nullopt;
  return *std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.fit.log_odds < b.fit.log_odds;
  });
}

std::optional<Sighting> Finder::Find(const TargetTrack& track, View* view,
                                     const Refuses& refuses) const {
  const auto boxes = WhereToLook(track.state, track.shape, view->camera,
                                 config_.motion.tilt_sigma_deg * M_PI / 180.0);
  if (!boxes) return std::nullopt;
  std::vector<size_t> inside;
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && (view->detections[i].box & boxes->search).area() > 0.0)
      inside.push_back(i);
  std::stable_sort(inside.begin(), inside.end(), [&](size_t a, size_t b) {
    return Likeness(view->detections[a].box, *boxes) > Likeness(view->detections[b].box, *boxes);
  });
  if (inside.size() > kMostTried) inside.resize(kMostTried);
  const auto best = Best(track, *view, inside, refuses, *boxes);
  if (best)
    for (const size_t i : inside)
      view->taken[i] = view->taken[i] || Overlap(view->detections[i], best->detection);
  return best;
}

std::optional<Sighting> Finder::Acquire(const View& view, const Detection& detection) const {
  auto fit = localiser_.Acquire(shape_, view.camera, detection,
                                Points(view, detection, Eigen::Vector3d::Zero(), false));
  if (!fit) return std::nullopt;
  FitInput input;
  input.shape = shape_;
  input.camera = view.camera;
  WeighHidden(view, input, &*fit);
  if (!fit->whole && fit->log_odds < kOdds) return std::nullopt;
  return Sighting{*fit, detection};
}

}  // namespace chase::perception
