#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "services/perception/sight/silhouette.h"

// Detections made of parts of others.

namespace chase::perception {

namespace {

constexpr int kCutReach = 3;  // px from a window's border within which it has cut

/// True when the blob goes on at this pixel.
bool On(const Detection& d, int x, int y) {
  const cv::Point p(x - d.mask_box.x, y - d.mask_box.y);
  return p.x >= 0 && p.y >= 0 && p.x < d.mask.cols && p.y < d.mask.rows &&
         d.mask.at<uint8_t>(p) != 0;
}

/// Outline, cuts, and what goes with the width, of a detection made of another's pixels; mask and
/// mask_box are its own.
void Describe(const cv::Mat& bgr, Detection* d) {
  const double width = d->box.width, departure = d->silhouette.departure_px;
  const double sharp = std::sqrt(std::pow(d->silhouette.sigma_px, 2) - departure * departure);
  d->box = EdgeBox(d->mask_box);
  d->cut = CutSides(d->mask_box, bgr.size());
  d->silhouette = TraceSilhouette(bgr, d->mask, d->mask_box, d->cut);
  d->silhouette.departure_px = departure * d->box.width / width;
  d->silhouette.sigma_px = std::hypot(sharp, d->silhouette.departure_px);
  d->inset_px *= d->box.width / width;
}

/// Takes out what the window has cut off: samples beyond which the blob goes on, and sides of which
/// no sample is left.
void LeaveOutCut(const Detection& whole, const cv::Rect& window, Detection* piece) {
  for (size_t side = 0; side < 4; ++side) {
    auto& samples = piece->silhouette.samples[side];
    const bool upright = side == kLeft || side == kRight;
    const int beyond = side == kLeft    ? window.x - 1
                       : side == kRight ? window.br().x
                       : side == kTop   ? window.y - 1
                                        : window.br().y;
    const auto goes_on = [&](const Eigen::Vector2d& px) {
      const int along = static_cast<int>(std::lround(upright ? px.y() : px.x()));
      return std::abs((upright ? px.x() : px.y()) - beyond) < kCutReach &&
             (upright ? On(whole, beyond, along) : On(whole, along, beyond));
    };
    const bool some = !samples.empty();
    samples.erase(std::remove_if(samples.begin(), samples.end(), goes_on), samples.end());
    if (some && samples.empty()) piece->cut[side] = piece->goes_on[side] = true;
  }
}

}  // namespace

std::optional<Detection> CropTo(const cv::Mat& bgr, const Detection& detection,
                                const cv::Rect& window) {
  const cv::Rect view = detection.mask_box & window;
  if (view.empty()) return std::nullopt;
  const cv::Mat seen = detection.mask(view - detection.mask_box.tl());
  const cv::Rect tight = cv::boundingRect(seen);
  if (tight.empty()) return std::nullopt;
  Detection out = detection;
  out.mask_box = tight + view.tl();
  out.mask = seen(tight).clone();
  Describe(bgr, &out);
  LeaveOutCut(detection, window, &out);
  return out;
}

}  // namespace chase::perception
