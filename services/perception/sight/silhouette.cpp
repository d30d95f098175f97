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
constexpr int kCutReach = 3;            // px from a window's border within which it has cut
constexpr size_t kMostLines = 6;        // that a blob is split along
constexpr double kSteep = 0.33;         // of a blob's extent that no leaning side jumps at once
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
  if (widths.empty()) return 1.0;
  const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::nth_element(widths.begin(), middle, widths.end());
  return *middle;
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

Detection Merge(const cv::Mat& bgr, const std::vector<Detection>& pieces) {
  Detection out = pieces.front();
  for (const auto& piece : pieces) out.mask_box |= piece.mask_box;
  out.mask = cv::Mat::zeros(out.mask_box.size(), CV_8U);
  for (const auto& piece : pieces) {
    cv::Mat place = out.mask(piece.mask_box - out.mask_box.tl());
    cv::max(place, piece.mask, place);
    out.score = std::max(out.score, piece.score);
  }
  Describe(bgr, &out);
  for (const auto& piece : pieces) KeepCut(piece, &out);
  return out;
}

}  // namespace chase::perception
