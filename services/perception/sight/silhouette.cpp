#include "services/perception/sight/silhouette.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace chase::perception {

namespace {

constexpr double kSideFrom = 0.25;      // rows used for left and right, share of the height:
constexpr double kSideTo = 0.85;        // without the caps
constexpr double kCapHalfWidth = 0.22;  // columns used for top and bottom, around the middle
constexpr double kMinContrast = 30.0;   // colour difference that allows placing between pixels
constexpr int kLeastDepth = 4;          // pixels across, fewer are not placed between pixels
constexpr int kReachShare = 8;          // of the blob, that its edges are looked for in
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

/// Where the edge lies, px from the first pixel's outer side, positive into the blob: the two
/// pixels at the edge are mixtures of their neighbours, and their shares add up to the place.
/// Neighbours further off may be of another shade.
double EdgeOffset(const Line& line, int depth) {
  if (depth < kLeastDepth || !line.Has(-2)) return 0.0;
  const Color inside = line.At(1), outside = line.At(-2);
  const Color span = inside - outside;
  if (span.norm() < kMinContrast) return 0.0;
  double covered = 0.0;
  for (const int i : {-1, 0})
    covered += std::clamp((line.At(i) - outside).dot(span) / span.squaredNorm(), 0.0, 1.0);
  return 1.0 - covered;
}

/// What EdgeWidth() says, of one line; nothing where inside and outside are too much alike.
std::optional<double> WidthOn(const Line& line, int depth) {
  const int reach = std::max(kLeastDepth / 2, depth / kReachShare);
  if (depth < kLeastDepth || !line.Has(-reach - 1)) return std::nullopt;
  const double span = (line.At(reach) - line.At(-reach - 1)).norm();
  if (span < kMinContrast) return std::nullopt;
  double steepest = 0.0;
  for (int i = -reach; i <= reach; ++i)
    steepest = std::max(steepest, (line.At(i) - line.At(i - 1)).norm());
  return std::max(1.0, span / steepest);
}

/// Shows lines that cross the blob, along the rows between its caps or the columns around its
/// middle: from either end of the blob, and how many pixels lie between.
template <class Show>
void ForEachCrossing(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi, bool rows,
                     const Show& show) {
  const double middle = 0.5 * (roi.width - 1), half = kCapHalfWidth * roi.width;
  const int from = rows ? static_cast<int>(kSideFrom * roi.height)
                        : std::max(0, static_cast<int>(std::ceil(middle - half)));
  const int to = rows ? std::max(from + 1, static_cast<int>(kSideTo * roi.height))
                      : std::min(roi.width, static_cast<int>(std::floor(middle + half)) + 1);
  const int stride = std::max(1, (to - from + kMaxSamples) / kMaxSamples);
  const cv::Point step(rows, !rows);
  for (int i = from; i < to; i += stride) {
    const auto [first, last] = Extent(rows ? mask.row(i) : mask.col(i));
    if (first < 0) continue;
    const cv::Point start = roi.tl() + i * cv::Point(!rows, rows);
    show(Line{&bgr, start + first * step, step}, Line{&bgr, start + last * step, -step},
         last - first + 1);
  }
}

/// Where the edge at the line's start lies, px.
Eigen::Vector2d EdgeAt(const Line& line, int depth) {
  const Eigen::Vector2d start(line.start.x, line.start.y), step(line.step.x, line.step.y);
  return start - 0.5 * step + EdgeOffset(line, depth) * step;
}

}  // namespace

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

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

Silhouette TraceSilhouette(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi,
                           const std::array<bool, 4>& cut) {
  Silhouette out;
  for (const bool rows : {true, false}) {
    const Side low = rows ? kLeft : kTop, high = rows ? kRight : kBottom;
    ForEachCrossing(bgr, mask, roi, rows, [&](const Line& first, const Line& last, int depth) {
      if (!cut[low]) out.samples[low].push_back(EdgeAt(first, depth));
      if (!cut[high]) out.samples[high].push_back(EdgeAt(last, depth));
    });
  }
  return out;
}

double EdgeWidth(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi) {
  std::vector<double> widths;
  ForEachCrossing(bgr, mask, roi, true, [&](const Line& first, const Line& last, int depth) {
    for (const Line& line : {first, last})
      if (const auto width = WidthOn(line, depth)) widths.push_back(*width);
  });
  return std::max(1.0, Median(std::move(widths)));
}

cv::Mat Region(const Detection& detection) {
  if (detection.mask.empty() || detection.inset_px <= 0.0) return detection.mask;
  cv::Mat framed, distance;  // the frame counts as outside
  cv::copyMakeBorder(detection.mask, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(framed, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Rect inner(1, 1, detection.mask.cols, detection.mask.rows);
  return cv::Mat(distance > detection.inset_px)(inner).clone();
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

}  // namespace chase::perception
