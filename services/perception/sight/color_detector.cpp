#include "services/perception/sight/color_detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kAspectTolerance = 0.35;  // one standard deviation of its logarithm
constexpr double kFillTolerance = 0.2;     // one standard deviation
constexpr size_t kMaxBlobs = 16;           // the best so many are looked at
constexpr double kMaskScore = 127.0;       // half of full score: the blob's pixels
constexpr double kOneThing = 0.85;         // score of a blob that is surely not several
constexpr double kWellShaped = 0.35;       // of a piece of one that may be
constexpr double kSharp = 2.0;             // px, width of an edge between two pixels or on one
constexpr int kSplitArea = 60;             // px^2 of a blob that may be several
constexpr size_t kMostPieces = 10;

double Bell(double x, double sigma) { return std::exp(-0.5 * (x / sigma) * (x / sigma)); }

/// Pixels of the colour: small holes filled, threads between blobs cut.
cv::Mat Mask(const cv::Mat& score) {
  static const cv::Mat kCross = cv::getStructuringElement(cv::MORPH_CROSS, {3, 3});
  cv::Mat mask;
  cv::threshold(score, mask, kMaskScore, 255.0, cv::THRESH_BINARY);
  cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, kCross);
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, kCross);
  return mask;
}

/// First and last pixel of each row: they have the hull of all.
std::vector<cv::Point> RowEnds(const cv::Mat& mask) {
  std::vector<cv::Point> ends;
  for (int y = 0; y < mask.rows; ++y) {
    const auto [first, last] = Extent(mask.row(y));
    if (first >= 0) ends.emplace_back(first, y);
    if (last > first) ends.emplace_back(last, y);
  }
  return ends;
}

/// 0 to 1 from aspect, fill and straightness; aspect and fill say nothing where the image ends.
double ShapeScore(const ShapeConfig& shape, const Detection& d, double area, double solid) {
  if (d.AnyCut()) return 0.6 * solid;
  const double aspect = d.box.width / d.box.height, fill = area / d.box.area();
  return solid * Bell(std::log(aspect / shape.aspect), kAspectTolerance) *
         Bell(fill - shape.fill, kFillTolerance);
}

/// Scores of the detection's box, mask and cuts.
void Rate(const ShapeConfig& shape, const cv::Mat& score, Detection* d) {
  std::vector<cv::Point> hull;
  cv::convexHull(RowEnds(d->mask), hull);
  const double half_border = 0.5 * static_cast<double>(hull.size());  // hulls run through
  const double area = cv::countNonZero(d->mask);                      // pixel centres
  const double hull_area =
      cv::contourArea(hull) + std::max(half_border, 0.5 * cv::arcLength(hull, true));
  const double color = cv::mean(score(d->mask_box), d->mask)[0] / 255.0;
  const double solid = std::min(1.0, area / std::max(hull_area, 1.0));
  d->solidity = color * solid;
  d->score = color * ShapeScore(shape, *d, area, solid);
}

Detection Describe(const ShapeConfig& shape, const cv::Mat& bgr, const cv::Mat& score,
                   const std::vector<cv::Point>& contour) {
  Detection d;
  d.mask_box = cv::boundingRect(contour);
  d.box = EdgeBox(d.mask_box);
  d.mask = cv::Mat::zeros(d.mask_box.size(), CV_8U);
  cv::drawContours(d.mask, std::vector<std::vector<cv::Point>>{contour}, 0, 255, cv::FILLED,
                   cv::LINE_8, cv::noArray(), INT_MAX, -d.mask_box.tl());
  d.inset_px = shape.inset * d.box.width;
  d.cut = CutSides(d.mask_box, bgr.size());
  Rate(shape, score, &d);
  return d;
}

void KeepBest(size_t most, std::vector<Detection>* found) {
  std::stable_sort(found->begin(), found->end(),
                   [](const Detection& a, const Detection& b) { return a.score > b.score; });
  if (found->size() > most) found->resize(most);
}

/// Adds the best shaped pieces of large enough blobs that are not surely one thing.
void AddPieces(const ShapeConfig& shape, const cv::Mat& bgr, const cv::Mat& score,
               std::vector<Detection>* found) {
  std::vector<Detection> pieces;
  for (const auto& whole : *found) {
    if (whole.score > kOneThing || cv::countNonZero(whole.mask) < kSplitArea) continue;
    for (auto& piece : Split(bgr, whole)) {
      Rate(shape, score, &piece);
      piece.part = whole.score > kWellShaped;
      if (piece.score > kWellShaped) pieces.push_back(std::move(piece));
    }
  }
  KeepBest(kMostPieces, &pieces);
  for (auto& piece : pieces) found->push_back(std::move(piece));
}

}  // namespace

std::vector<Detection> ColorDetector::Detect(const cv::Mat& bgr) const {
  const cv::Mat score = color_.Score(bgr);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(Mask(score), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<Detection> found;
  for (const auto& contour : contours) {
    const cv::Rect box = cv::boundingRect(contour);
    if (box.area() < kLeastArea) continue;
    Detection d = Describe(shape_, bgr, score, contour);
    if (cv::countNonZero(d.mask) >= kLeastArea) found.push_back(std::move(d));
  }
  KeepBest(kMaxBlobs, &found);
  for (auto& d : found) {
    d.silhouette = TraceSilhouette(bgr, d.mask, d.mask_box, d.cut);
    const double blur = std::max(1.0, EdgeWidth(bgr, d.mask, d.mask_box) / kSharp);
    d.silhouette.departure_px = shape_.outline_sigma * d.box.width;
    d.silhouette.sigma_px = std::hypot(blur * edge_sigma_px_, d.silhouette.departure_px);
  }
  AddPieces(shape_, bgr, score, &found);
  return found;
}

}  // namespace chase::perception
