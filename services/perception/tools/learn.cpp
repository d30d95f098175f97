#include "services/perception/tools/learn.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "services/perception/sight/color_detector.h"
#include "services/perception/sight/color_model.h"
#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kPixel = 1.0;  // px, of a side behind the outermost of its samples
constexpr double kMostInset = 0.2, kInsetStep = 0.01;  // shares of the width

/// A mask has two values, but for a few pixels along the marked outline; a photo has many.
bool HasTwoValues(const cv::Mat& mask) {
  constexpr double kLeast = 0.9;  // share of the pixels
  std::array<int, 256> counts{};
  for (int row = 0; row < mask.rows; ++row)
    for (int column = 0; column < mask.cols; ++column) ++counts[mask.at<uchar>(row, column)];
  std::nth_element(counts.begin(), counts.begin() + 1, counts.end(), std::greater<>());
  return counts[0] + counts[1] >= kLeast * static_cast<double>(mask.total());
}

void Check(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks) {
  if (images.empty() || images.size() != masks.size())
    throw std::invalid_argument("give one mask for each image, and at least one of both");
  for (size_t i = 0; i < images.size(); ++i) {
    const std::string pair = "pair " + std::to_string(i + 1);
    if (images[i].type() != CV_8UC3 || masks[i].type() != CV_8UC1)
      throw std::invalid_argument(pair + ": needs a colour image and a grey mask, 8 bit");
    if (images[i].size() != masks[i].size())
      throw std::invalid_argument(pair + ": image and mask differ in size");
    if (cv::countNonZero(masks[i]) == 0)
      throw std::invalid_argument(pair + ": the mask marks nothing");
    if (cv::countNonZero(masks[i]) == static_cast<int>(masks[i].total()) || !HasTwoValues(masks[i]))
      throw std::invalid_argument(
          pair + ": the mask is a picture; a mask is 0 off the target, one value on it");
  }
}

/// The blob that covers most of the mask; null where none does. Pieces of a blob come after it and
/// cover less: masks are drawn inside the outline, which pieces suit better than the whole.
const Detection* MarkedBlob(const std::vector<Detection>& found, const cv::Mat& mask) {
  const Detection* marked = nullptr;
  int most = 0;
  for (const auto& d : found) {
    const int covered = cv::countNonZero(d.mask & mask(d.mask_box));
    if (covered <= most) continue;
    most = covered;
    marked = &d;
  }
  return marked;
}

/// Why a marked blob does not tell the target's shape; empty when it does.
std::string WhyShapeless(const Detection* marked, const cv::Size& image) {
  if (!marked) return "no blob of the learned colour lies where the mask marks the target";
  // A piece's own cuts do not count: where another thing begins, the target ends.
  const auto cut = CutSides(marked->mask_box, image);
  return std::count(cut.begin(), cut.end(), true) ? "the image cuts the marked blob" : "";
}

[[noreturn]] void RefuseAll(const std::vector<std::string>& shapeless) {
  std::string message = "no picture tells the target's shape: ";
  for (const auto& pair : shapeless) message += pair + "; ";
  throw std::invalid_argument(message + "give one with all of the target inside the picture");
}

/// How far the sides of a blob depart from those of an upright box or cylinder, or of a sphere,
/// whichever is nearer: root of the mean square, share of its width, less what pixels make of it.
double Departure(const Detection& d) {
  const double middle = d.box.x + 0.5 * d.box.width, half = 0.5 * d.box.width;
  const double level = d.box.y + 0.5 * d.box.height;
  double straight = 0.0, round = 0.0, n = 0.0;
  for (const Side side : {kLeft, kRight})
    for (const auto& px : d.silhouette.samples[side]) {
      const double reach = std::abs(px.x() - middle), up = 2.0 * (px.y() - level) / d.box.height;
      straight += std::pow(reach - half, 2);
      round += std::pow(reach - half * std::sqrt(std::max(0.0, 1.0 - up * up)), 2);
      ++n;
    }
  const double square = std::min(straight, round) / std::max(1.0, n) - kPixel * kPixel;
  return std::sqrt(std::max(0.0, square)) / d.box.width;
}

/// Aspect, fill and departure of the blobs that the masks mark, as medians: a blob may hold more
/// than the target. Gives the pairs that do not tell them, and why.
std::vector<std::string> LearnShape(const std::vector<cv::Mat>& images,
                                    const std::vector<cv::Mat>& masks,
                                    const std::vector<Separation>& pictures,
                                    DetectorConfig* config) {
  const ColorDetector detector(*config, 1.0);
  std::vector<std::string> shapeless;
  std::vector<double> aspects, fills, departures;
  for (size_t i = 0; i < images.size(); ++i) {
    const auto found = detector.Detect(images[i]);
    const Detection* marked = MarkedBlob(found, masks[i]);
    const std::string why =
        pictures[i].used ? WhyShapeless(marked, images[i].size()) : "its colours are left out";
    if (!why.empty()) {
      shapeless.push_back("pair " + std::to_string(i + 1) + ": " + why);
      continue;
    }
    aspects.push_back(marked->box.width / marked->box.height);
    fills.push_back(cv::countNonZero(marked->mask) / marked->box.area());
    departures.push_back(Departure(*marked));
  }
  if (aspects.empty()) RefuseAll(shapeless);
  config->shape.aspect = Median(aspects);
  config->shape.fill = Median(fills);
  config->shape.outline_sigma = Median(departures);
  return shapeless;
}

double BestOverlap(const ColorDetector& detector, const cv::Mat& bgr, const cv::Mat& mask) {
  const auto found = detector.Detect(bgr);
  const Detection* best = MostLikely(found);
  return best ? Overlap(*best, mask) : 0.0;
}

/// Over the pictures that the colour is from, a share of all.
double MeanOverlap(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                   const std::vector<Separation>& pictures, const ColorDetector& detector) {
  double sum = 0.0;
  for (size_t i = 0; i < images.size(); ++i)
    if (pictures[i].used) sum += BestOverlap(detector, images[i], masks[i]);
  return sum / static_cast<double>(images.size());
}

/// Half-way between the target's scores, in the median, and the best of anything else's in the
/// pictures that the colour is from.
double AcquireScore(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                    const std::vector<Separation>& pictures, const ColorDetector& detector) {
  std::vector<double> target;
  double other = 0.0;
  for (size_t i = 0; i < images.size(); ++i) {
    if (!pictures[i].used) continue;
    const auto found = detector.Detect(images[i]);
    if (const Detection* marked = MarkedBlob(found, masks[i])) target.push_back(marked->score);
    for (const auto& d : found)
      if (!d.part && cv::countNonZero(d.mask & masks[i](d.mask_box)) == 0)
        other = std::max(other, d.score);
  }
  return 0.5 * (Median(std::move(target)) + other);
}

}  // namespace

const Detection* MostLikely(const std::vector<Detection>& found) {
  const Detection* best = nullptr;
  for (const auto& d : found) {
    const bool candidate = !best || (!d.part && !d.AnyCut());
    if (candidate && (!best || d.score > best->score)) best = &d;
  }
  return best;
}

double Overlap(const Detection& detection, const cv::Mat& mask) {
  cv::Mat whole = cv::Mat::zeros(mask.size(), CV_8U);
  if (detection.mask.empty())
    whole(cv::Rect(detection.box) & cv::Rect({0, 0}, mask.size())).setTo(255);
  else
    Region(detection).copyTo(whole(detection.mask_box));
  const int both = cv::countNonZero((whole > 0) & (mask > 0));
  const int either = cv::countNonZero((whole > 0) | (mask > 0));
  return either > 0 ? static_cast<double>(both) / either : 1.0;
}

double Overlap(const DetectorConfig& config, const cv::Mat& bgr, const cv::Mat& mask) {
  return BestOverlap(ColorDetector(config, 1.0), bgr, mask);
}

Learned LearnDetector(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& given,
                      const DetectorConfig& base) {
  Check(images, given);
  std::vector<cv::Mat> masks;  // of soft edges the inner half
  for (const auto& mask : given) {
    double most = 0.0;
    cv::minMaxLoc(mask, nullptr, &most);
    masks.push_back(mask > 0.5 * most);
  }
  DetectorConfig config = base;
  config.kind = "color";
  config.color.white_balance = false;  // the pictures' own light is in the colours
  const LearnedColor color_of = LearnColor(images, masks, config.color);
  config.color = color_of.config;
  const auto shapeless = LearnShape(images, masks, color_of.pictures, &config);
  const ColorModel color(config.color);
  Learned best;
  for (int i = 0; i * kInsetStep <= kMostInset; ++i) {
    config.shape.inset = i * kInsetStep;
    const double overlap =
        MeanOverlap(images, masks, color_of.pictures, ColorDetector(config.shape, color, 1.0));
    if (i == 0 || overlap > best.overlap) best = {config, 0.0, overlap, shapeless, color_of};
  }
  best.acquire_score =
      AcquireScore(images, masks, color_of.pictures, ColorDetector(best.config.shape, color, 1.0));
  return best;
}

}  // namespace chase::perception
