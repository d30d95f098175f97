#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "services/perception/sight/silhouette.h"

// Detections made of parts of others.

namespace chase::perception {

namespace {

constexpr int kCutReach = 3;      // px from a window's border within which it has cut
constexpr size_t kMostLines = 6;  // that a blob is split along
constexpr double kSteep = 0.33;   // of a blob's extent that no leaning side jumps at once

/// True when the blob goes on at this pixel.
bool On(const Detection& d, int x, int y) {
  const cv::Point p(x - d.mask_box.x, y - d.mask_box.y);
  return p.x >= 0 && p.y >= 0 && p.x < d.mask.cols && p.y < d.mask.rows &&
         d.mask.at<uint8_t>(p) != 0;
}

/// Side of a box, px.
int SideOf(const cv::Rect& box, size_t side) {
  return side == kLeft ? box.x : side == kRight ? box.br().x : side == kTop ? box.y : box.br().y;
}

/// Outline, cuts, and what goes with the width, of a detection made of another's pixels, or of
/// several; mask and mask_box are its own.
void Describe(const cv::Mat& bgr, Detection* d) {
  const double width = d->box.width, departure = d->silhouette.departure_px;
  const double sharp = std::sqrt(std::pow(d->silhouette.sigma_px, 2) - departure * departure);
  d->box = EdgeBox(d->mask_box);
  d->cut = CutSides(d->mask_box, bgr.size());
  d->goes_on = d->parted = {};
  d->silhouette = TraceSilhouette(bgr, d->mask, d->mask_box, d->cut);
  d->silhouette.departure_px = departure * d->box.width / width;
  d->silhouette.sigma_px = std::hypot(sharp, d->silhouette.departure_px);
  d->inset_px *= d->box.width / width;
}

/// A side of a piece at which a like colour goes on stays one where it still ends the piece.
void KeepCut(const Detection& piece, Detection* out) {
  for (size_t side = 0; side < 4; ++side)
    if (piece.goes_on[side] && SideOf(piece.mask_box, side) == SideOf(out->mask_box, side)) {
      out->cut[side] = out->goes_on[side] = true;
      out->parted[side] = piece.parted[side];
      out->silhouette.samples[side].clear();
    }
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

/// A column at which the blob's upper or lower end jumps: there one thing ends before another.
struct Jump {
  int column, height;
};

/// Of jumps closer together than a piece may be wide, as where a side leans or threads join two
/// things, the highest.
std::vector<Jump> Jumps(const cv::Mat& mask) {
  const int least = std::max(3, mask.rows / 12);
  std::vector<std::pair<int, int>> ends;
  for (int x = 0; x < mask.cols; ++x) ends.push_back(Extent(mask.col(x)));
  std::vector<Jump> jumps;
  for (int x = kLeastPiece; x <= mask.cols - kLeastPiece; ++x) {
    const auto &a = ends[static_cast<size_t>(x - 1)], &b = ends[static_cast<size_t>(x)];
    const int height = std::max(std::abs(a.first - b.first), std::abs(a.second - b.second));
    if (height < least) continue;
    if (jumps.empty() || x - jumps.back().column >= kLeastPiece)
      jumps.push_back({x, height});
    else if (height > jumps.back().height)
      jumps.back() = {x, height};
  }
  return jumps;
}

/// The part of a blob inside a window without slivers along it, as the leaning side of what was cut
/// off leaves them; nothing when none is left.
std::optional<Detection> CropWithoutSlivers(const cv::Mat& bgr, const Detection& detection,
                                            const cv::Rect& window, bool upright) {
  const cv::Rect view = detection.mask_box & window;
  if (view.empty()) return std::nullopt;
  const cv::Mat line = cv::Mat::ones(upright ? 1 : kLeastPiece, upright ? kLeastPiece : 1, CV_8U);
  Detection cleared = detection;
  cleared.mask = detection.mask.clone();
  cv::Mat seen = cleared.mask(view - detection.mask_box.tl());
  cv::Mat framed;  // what lies beyond the window is none of the piece
  cv::copyMakeBorder(seen, framed, kLeastPiece, kLeastPiece, kLeastPiece, kLeastPiece,
                     cv::BORDER_CONSTANT | cv::BORDER_ISOLATED, cv::Scalar(0));
  cv::morphologyEx(framed, framed, cv::MORPH_OPEN, line);
  framed(cv::Rect(kLeastPiece, kLeastPiece, seen.cols, seen.rows)).copyTo(seen);
  return CropTo(bgr, cleared, window);
}

/// Adds the pieces between any two of the lines across a blob. The side of a thing may lean over a
/// few columns, but jumps as high as `steep` are its end.
void AddBetween(const cv::Mat& bgr, const Detection& detection, std::vector<Jump> lines,
                bool upright, std::vector<Detection>* pieces) {
  const cv::Rect& box = detection.mask_box;
  const int steep = static_cast<int>(kSteep * (upright ? box.height : box.width));
  lines.insert(lines.begin(), {0, steep});
  lines.push_back({upright ? box.width : box.height, steep});
  const size_t n = lines.size();
  if (n < 3 || n > kMostLines) return;
  for (size_t a = 0; a + 1 < n; ++a)
    for (size_t b = a + 1; b < n; ++b) {
      const int from = lines[a].column, size = lines[b].column - from;
      if (b - a == n - 1 || size < kLeastPiece) continue;
      const cv::Rect window = upright ? cv::Rect(box.x + from, box.y, size, box.height)
                                      : cv::Rect(box.x, box.y + from, box.width, size);
      auto piece = std::min(lines[a].height, lines[b].height) < steep
                       ? CropTo(bgr, detection, window)
                       : CropWithoutSlivers(bgr, detection, window, upright);
      if (!piece) continue;
      piece->parted = piece->goes_on;
      pieces->push_back(std::move(*piece));
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
  KeepCut(detection, &out);
  LeaveOutCut(detection, window, &out);
  return out;
}

std::vector<Detection> Split(const cv::Mat& bgr, const Detection& detection) {
  std::vector<Detection> pieces;
  AddBetween(bgr, detection, Jumps(detection.mask), true, &pieces);
  AddBetween(bgr, detection, Jumps(detection.mask.t()), false, &pieces);
  return pieces;
}

}  // namespace chase::perception
