#include "services/perception/silhouette.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace chase::perception {

namespace {

constexpr int kMaxSamples = 12;         // a side
constexpr double kSideFrom = 0.25;      // rows used for left and right, share of the height:
constexpr double kSideTo = 0.85;        // without the caps
constexpr double kCapHalfWidth = 0.22;  // columns used for top and bottom, around the middle
constexpr double kMinContrast = 30.0;   // colour difference that allows placing between pixels
constexpr int kReach = 3;               // pixels looked at on either side of an edge
constexpr int kBorder = 1;              // px; nearer to the image's border counts as cut

using Color = Eigen::Vector3d;

/// A line of pixels across the image, `at` counting inwards to the blob.
struct Line {
  const cv::Mat* bgr;
  cv::Point start, step;  // `start`: the blob's first pixel; `step`: one pixel into the blob

  bool Has(int at) const {
    const cv::Point p = start + at * step;
    return p.x >= 0 && p.y >= 0 && p.x < bgr->cols && p.y < bgr->rows;
  }
  Color At(int at) const {
    const cv::Point p = start + at * step;
    const auto& c = bgr->at<cv::Vec3b>(p);
    return {static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
  }
};

/// Where the edge lies, px from the first pixel's outer side, positive into the blob: the pixels
/// around it are mixtures of inside and outside, and their shares add up to the place.
double EdgeOffset(const Line& line, int depth) {
  if (depth < 2 * kReach || !line.Has(-kReach - 1)) return 0.0;
  const Color inside = 0.5 * (line.At(kReach - 1) + line.At(kReach));
  const Color outside = 0.5 * (line.At(-kReach) + line.At(-kReach - 1));
  const Color span = inside - outside;
  if (span.norm() < kMinContrast) return 0.0;
  double covered = 0.0;
  for (int i = 1 - kReach; i < kReach - 1; ++i)
    covered += std::clamp((line.At(i) - outside).dot(span) / span.squaredNorm(), 0.0, 1.0);
  const double offset = (kReach - 1) - covered;
  return std::abs(offset) < 1.5 ? offset : 0.0;
}

/// First and last set pixel of a row or column, or (-1, -1).
std::pair<int, int> Extent(const cv::Mat& line) {
  int first = -1, last = -1;
  const int n = static_cast<int>(line.total());
  for (int i = 0; i < n; ++i)
    if (line.rows == 1 ? line.at<uint8_t>(0, i) : line.at<uint8_t>(i, 0)) {
      if (first < 0) first = i;
      last = i;
    }
  return {first, last};
}

int Stride(int from, int to) { return std::max(1, (to - from + kMaxSamples) / kMaxSamples); }

void TraceSides(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi,
                const std::array<bool, 4>& cut, Silhouette* out) {
  const int from = static_cast<int>(kSideFrom * roi.height);
  const int to = std::max(from + 1, static_cast<int>(kSideTo * roi.height));
  for (int y = from; y < to; y += Stride(from, to)) {
    const auto [first, last] = Extent(mask.row(y));
    if (first < 0) continue;
    const int v = roi.y + y, depth = last - first + 1;
    const Line left{&bgr, {roi.x + first, v}, {1, 0}}, right{&bgr, {roi.x + last, v}, {-1, 0}};
    if (!cut[kLeft])
      out->samples[kLeft].emplace_back(roi.x + first - 0.5 + EdgeOffset(left, depth), v);
    if (!cut[kRight])
      out->samples[kRight].emplace_back(roi.x + last + 0.5 - EdgeOffset(right, depth), v);
  }
}

void TraceCaps(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi,
               const std::array<bool, 4>& cut, Silhouette* out) {
  const double middle = 0.5 * (roi.width - 1), half = kCapHalfWidth * roi.width;
  const int from = std::max(0, static_cast<int>(std::ceil(middle - half)));
  const int to = std::min(roi.width, static_cast<int>(std::floor(middle + half)) + 1);
  for (int x = from; x < to; x += Stride(from, to)) {
    const auto [first, last] = Extent(mask.col(x));
    if (first < 0) continue;
    const int u = roi.x + x, depth = last - first + 1;
    const Line top{&bgr, {u, roi.y + first}, {0, 1}}, bottom{&bgr, {u, roi.y + last}, {0, -1}};
    if (!cut[kTop])
      out->samples[kTop].emplace_back(u, roi.y + first - 0.5 + EdgeOffset(top, depth));
    if (!cut[kBottom])
      out->samples[kBottom].emplace_back(u, roi.y + last + 0.5 - EdgeOffset(bottom, depth));
  }
}

}  // namespace

Silhouette TraceSilhouette(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi,
                           const std::array<bool, 4>& cut) {
  Silhouette out;
  TraceSides(bgr, mask, roi, cut, &out);
  TraceCaps(bgr, mask, roi, cut, &out);
  return out;
}

cv::Rect2d EdgeBox(const cv::Rect& roi) {
  return {roi.x - 0.5, roi.y - 0.5, static_cast<double>(roi.width),
          static_cast<double>(roi.height)};
}

std::array<bool, 4> CutSides(const cv::Rect& roi, const cv::Size& image) {
  std::array<bool, 4> cut;
  cut[kLeft] = roi.x <= kBorder;
  cut[kRight] = roi.x + roi.width >= image.width - kBorder;
  cut[kTop] = roi.y <= kBorder;
  cut[kBottom] = roi.y + roi.height >= image.height - kBorder;
  return cut;
}

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
  out.box = EdgeBox(out.mask_box);
  const auto image_cut = CutSides(out.mask_box, bgr.size());
  const auto goes_on = [&](Side side, bool at_window, bool beyond) {
    out.cut[side] = image_cut[side] || (at_window && beyond);
  };
  const cv::Rect &a = out.mask_box, &b = detection.mask_box;
  goes_on(kLeft, a.x == window.x, b.x < a.x);
  goes_on(kRight, a.br().x == window.br().x, b.br().x > a.br().x);
  goes_on(kTop, a.y == window.y, b.y < a.y);
  goes_on(kBottom, a.br().y == window.br().y, b.br().y > a.br().y);
  out.silhouette = TraceSilhouette(bgr, out.mask, out.mask_box, out.cut);
  out.silhouette.sigma_px = detection.silhouette.sigma_px;
  return out;
}

Detection Merge(const cv::Mat& bgr, const std::vector<Detection>& pieces) {
  Detection out = pieces.front();
  for (const auto& piece : pieces) out.mask_box |= piece.mask_box;
  out.mask = cv::Mat::zeros(out.mask_box.size(), CV_8U);
  for (const auto& piece : pieces) {
    cv::Mat place = out.mask(piece.mask_box - out.mask_box.tl());
    cv::max(place, piece.mask, place);
    out.score = std::max(out.score, piece.score);
  }
  out.box = EdgeBox(out.mask_box);
  out.cut = CutSides(out.mask_box, bgr.size());
  const double sigma = out.silhouette.sigma_px;
  out.silhouette = TraceSilhouette(bgr, out.mask, out.mask_box, out.cut);
  out.silhouette.sigma_px = sigma;
  return out;
}

}  // namespace chase::perception
