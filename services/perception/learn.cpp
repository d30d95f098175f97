#include "services/perception/learn.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "services/perception/color_detector.h"
#include "services/perception/color_model.h"
#include "services/perception/silhouette.h"

namespace chase::perception {

namespace {

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

double Overlap(const cv::Mat& region, const cv::Rect& at, const cv::Mat& mask) {
  cv::Mat whole = cv::Mat::zeros(mask.size(), CV_8U);
  region.copyTo(whole(at));
  const int both = cv::countNonZero((whole > 0) & (mask > 0));
  const int either = cv::countNonZero((whole > 0) | (mask > 0));
  return static_cast<double>(both) / either;
}

/// The blob that overlaps most with the mask; null where none does.
const Detection* MarkedBlob(const std::vector<Detection>& found, const cv::Mat& mask) {
  const Detection* marked = nullptr;
  double most = 0.0;
  for (const auto& d : found) {
    const double overlap = Overlap(d.mask, d.mask_box, mask);
    if (overlap <= most) continue;
    most = overlap;
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

/// Aspect and fill of the blobs that the masks mark, as geometric and plain means. Gives the pairs
/// that do not tell them, and why.
std::vector<std::string> LearnShape(const std::vector<cv::Mat>& images,
                                    const std::vector<cv::Mat>& masks, DetectorConfig* config) {
  const ColorDetector detector(*config, 1.0);
  std::vector<std::string> shapeless;
  double log_aspect = 0.0, fill = 0.0;
  int n = 0;
  for (size_t i = 0; i < images.size(); ++i) {
    const auto found = detector.Detect(images[i]);
    const Detection* marked = MarkedBlob(found, masks[i]);
    const std::string why = WhyShapeless(marked, images[i].size());
    if (!why.empty()) {
      shapeless.push_back("pair " + std::to_string(i + 1) + ": " + why);
      continue;
    }
    log_aspect += std::log(marked->box.width / marked->box.height);
    fill += cv::countNonZero(marked->mask) / marked->box.area();
    ++n;
  }
  if (n == 0) RefuseAll(shapeless);
  config->shape.aspect = std::exp(log_aspect / n);
  config->shape.fill = fill / n;
  return shapeless;
}

double Overlap(const ColorDetector& detector, const cv::Mat& bgr, const cv::Mat& mask) {
  const auto found = detector.Detect(bgr);
  if (found.empty()) return 0.0;
  return Overlap(Region(found.front()), found.front().mask_box, mask);
}

double MeanOverlap(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                   const ColorDetector& detector) {
  double sum = 0.0;
  for (size_t i = 0; i < images.size(); ++i) sum += Overlap(detector, images[i], masks[i]);
  return sum / static_cast<double>(images.size());
}

}  // namespace

double Overlap(const DetectorConfig& config, const cv::Mat& bgr, const cv::Mat& mask) {
  return Overlap(ColorDetector(config, 1.0), bgr, mask);
}

Learned LearnDetector(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                      const DetectorConfig& base) {
  Check(images, masks);
  DetectorConfig config = base;
  config.kind = "color";
  config.color.white_balance = false;  // the pictures' own light is in the colours
  config.color = LearnColor(images, masks, config.color);
  const auto shapeless = LearnShape(images, masks, &config);
  const ColorModel color(config.color);
  Learned best;
  for (int i = 0; i * kInsetStep <= kMostInset; ++i) {
    config.shape.inset = i * kInsetStep;
    const double overlap = MeanOverlap(images, masks, ColorDetector(config.shape, color, 1.0));
    if (i == 0 || overlap > best.overlap) best = {config, overlap, shapeless};
  }
  return best;
}

}  // namespace chase::perception
