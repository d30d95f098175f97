#include "deploy/detect/picture.h"

#include <cmath>

#include "services/perception/place/localiser.h"
#include "services/perception/place/target_points.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {

namespace {

constexpr double kSameShape = 0.01;  // share by which the aspect of a resized picture may differ

/// The camera at the picture's resolution; nothing where it shows another part of the world.
std::optional<world::Rig> RigFor(const world::Rig& rig, const cv::Size& size) {
  const double scale = static_cast<double>(size.width) / rig.width_px;
  if (std::abs(scale * rig.height_px - size.height) > kSameShape * size.height) return std::nullopt;
  world::Rig scaled = rig;
  scaled.width_px = size.width;
  scaled.height_px = size.height;
  scaled.focal_px *= scale;
  scaled.center_u_px = (rig.center_u_px + 0.5) * scale - 0.5;
  scaled.readout = 0.0;  // nothing moves
  scaled.center_v_px = (rig.center_v_px + 0.5) * scale - 0.5;
  return scaled;
}

}  // namespace

PictureDetector::PictureDetector(const PerceptionConfig& config)
    : config_(config),
      size_(config.rig.width_px, config.rig.height_px),
      detector_(MakeDetector(config.detector, config.fit.edge_sigma_px, config.rig)) {}

std::optional<PictureTarget> PictureDetector::Find(const cv::Mat& bgr) {
  const auto rig = RigFor(config_.rig, bgr.size());
  if (bgr.size() != size_)
    detector_ =
        MakeDetector(config_.detector, config_.fit.edge_sigma_px, rig.value_or(config_.rig));
  size_ = bgr.size();
  const auto found = detector_->Detect(bgr);
  const Detection* best = MostLikely(found);
  if (!best || best->score < config_.state.acquire_score) return std::nullopt;
  PictureTarget target{*best, {}, {}};
  if (!rig) return target;
  const Camera camera = CameraAt({}, *rig);
  const auto fit = Localiser(config_).Acquire(ShapeOf(config_), camera, *best, {});
  if (!fit) return target;
  target.range = (fit->posterior.position() - camera.p_WC).norm();
  target.range_sigma = std::hypot(RangeSigma(fit->posterior, camera),
                                  config_.detector.shape.outline_sigma * *target.range);
  return target;
}

void Evaluation::Add(const std::optional<PictureTarget>& target, const cv::Mat& mask) {
  const bool there = cv::countNonZero(mask) > 0;
  const double overlap = target && there ? Overlap(target->detection, mask) : 0.0;
  with_target += there;
  claimed += target.has_value();
  found += overlap >= kFound;
  overlaps += overlap;
}

}  // namespace chase::perception
