#include "services/perception/belief/finder.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/sensors/image_check.h"
#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr size_t kMaxSweeps = 4;
constexpr double kOdds = 0.0;               // logarithm of the odds that a sighting needs,
constexpr double kSureOdds = 8.0;           // and with which no other is tried
constexpr size_t kMostTried = 4;            // detections a track and frame
constexpr double kMaxExtrapolation = 0.05;  // s that the nearest pose is carried to a frame
constexpr double kMaxPoseAge = 0.2;   // s; with a pose this near it is too old, else there is none
constexpr double kMaxSweepAge = 0.3;  // s; older points are not used

constexpr double kBoxMargin = 0.25;  // share of the expected box in which a piece may lie
constexpr double kGateSigmas = 3.0;

bool Overlap(const Detection& a, const Detection& b) { return (a.box & b.box).area() > 0.0; }

cv::Rect2d Grown(const cv::Rect2d& box, double dx, double dy) {
  return {box.x - dx, box.y - dy, box.width + 2 * dx, box.height + 2 * dy};
}

/// Where in the image a thing may be seen, given how well it is known.
struct SearchBoxes {
  cv::Rect2d expected;  ///< its own, px
  cv::Rect2d search;    ///< pieces of it may lie here
  cv::Rect2d trim;      ///< all of it lies here
};

/// Nothing where it lies behind the camera. `tilt`: standard deviation of the camera's, rad.
std::optional<SearchBoxes> WhereToLook(const TargetGaussian& thing, const TargetShape& shape,
                                       const Camera& camera, double tilt) {
  const auto box = ProjectTarget(camera, thing.position(), shape);
  if (!box) return std::nullopt;
  const double range = (thing.position() - camera.p_WC).norm();
  const double sigma = std::sqrt(thing.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  const double px = camera.PixelsPerRadian({box->x + 0.5 * box->width, box->y + 0.5 * box->height});
  const double spread = kGateSigmas * sigma / range * px, tilted = kGateSigmas * tilt * px;
  const double margin = tilted + spread, trim = 0.5 * tilted + spread;
  return SearchBoxes{
      *box, Grown(*box, margin + kBoxMargin * box->width, margin + kBoxMargin * box->height),
      Grown(*box, trim, trim)};
}

/// The part of a detection that may be the thing: where the detection is larger, a like colour
/// behind goes on outside. Nothing where no part of it lies inside.
std::optional<Detection> Within(const SearchBoxes& boxes, const cv::Mat& bgr,
                                const Detection& detection) {
  if (detection.mask.empty() || !detection.LargerThan(boxes.expected)) return detection;
  const cv::Rect2d& trim = boxes.trim;
  const cv::Rect window(static_cast<int>(std::floor(trim.x)), static_cast<int>(std::floor(trim.y)),
                        static_cast<int>(std::ceil(trim.width)),
                        static_cast<int>(std::ceil(trim.height)));
  return CropTo(bgr, detection, window);
}

/// True for a piece of what is the thing as a whole: no other thing beside it need be assumed.
bool PieceOf(const Sighting& s, const Detection& d) {
  return d.part && !s.detection.part && s.fit.whole && Overlap(d, s.detection);
}

}  // namespace

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

/// One detection as the thing of a track, by the sweeps that it has not seen yet.
std::optional<Sighting> Finder::Try(const Track& track, const View& view,
                                    const Detection& detection) const {
  FitInput input;
  input.prior = track.state;
  input.shape = track.shape;
  input.camera = view.camera;
  input.detection = &detection;
  input.reappears = track.misses > 0 || track.partial;
  auto fit = localiser_.Correct(input, Points(view, detection, track.state.velocity(), true));
  if (fit) WeighHidden(view, input, &*fit);
  if (!fit || fit->log_odds < kOdds) return std::nullopt;
  return Sighting{*fit, detection};
}

std::optional<Sighting> Finder::Find(const Track& track, View* view) const {
  const auto boxes = WhereToLook(track.state, track.shape, view->camera,
                                 config_.motion.tilt_sigma_deg * M_PI / 180.0);
  if (!boxes) return std::nullopt;
  std::vector<size_t> inside;
  for (size_t i = 0; i < view->detections.size(); ++i)
    if (!view->taken[i] && (view->detections[i].box & boxes->search).area() > 0.0)
      inside.push_back(i);
  if (inside.size() > kMostTried) inside.resize(kMostTried);
  std::optional<Sighting> best;
  for (const size_t i : inside) {
    if (best && PieceOf(*best, view->detections[i])) continue;
    const auto piece = Within(*boxes, view->bgr, view->detections[i]);
    const auto s = piece ? Try(track, *view, *piece) : std::nullopt;
    if (s && (!best || s->fit.log_odds > best->fit.log_odds)) best = s;
    if (best && track.misses == 0 && best->fit.whole && best->fit.log_odds > kSureOdds) break;
  }
  for (const size_t i : inside)
    view->taken[i] = view->taken[i] || (best && Overlap(view->detections[i], best->detection));
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
