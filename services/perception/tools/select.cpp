#include "services/perception/tools/select.h"

#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "services/perception/sight/color_detector.h"
#include "services/perception/sight/silhouette.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {

namespace {

constexpr int kPatch = 2;            // px around the pixel that are learned first
constexpr int kGrowths = 3;          // each learns from all that the one before has found
constexpr uchar kAccepted = 128;     // score of a pixel that the detector takes
constexpr double kMostShare = 0.25;  // of the picture: at two widths' distance nothing shows more
constexpr double kLeastIndex =
    0.25;  // as many false pixels near it, and elsewhere, as it has itself
constexpr double kLeastOverlap = 0.5;

/// Pixels of the colour of `mask` that are connected with it.
cv::Mat Grown(const cv::Mat& bgr, const cv::Mat& mask, const ColorConfig& base) {
  const ColorModel color(LearnColor({bgr}, {mask}, base).config);
  cv::Mat labels, grown = mask.clone();
  cv::connectedComponents((color.Score(bgr) >= kAccepted) | mask, labels, 4);
  std::vector<cv::Point> marked;
  cv::findNonZero(mask, marked);
  grown.setTo(255, labels == labels.at<int>(marked[marked.size() / 2]));
  return grown;
}

Selection Refused(std::string why) { return {std::move(why), {}, {}}; }

std::string Percent(double share) {
  char text[16];
  std::snprintf(text, sizeof text, "%.0f %%", 100.0 * share);
  return text;
}

/// What the size of the thing has against it; empty: nothing.
std::string Unfit(const cv::Mat& mask) {
  const double area = cv::countNonZero(mask), share = area / static_cast<double>(mask.total());
  if (area < ColorDetector::kLeastArea)
    return "only " + std::to_string(static_cast<int>(area)) +
           " pixels of one colour are there: go nearer";
  if (share > kMostShare)
    return "that colour runs on over " + Percent(share) + " of the image: point at the target";
  const auto cut = CutSides(cv::boundingRect(mask), mask.size());
  if (std::count(cut.begin(), cut.end(), true) > 0)
    return "the image cuts it: select it when all of it is in view";
  return "";
}

}  // namespace

Selection LearnAt(const cv::Mat& bgr, const cv::Point& at, const DetectorConfig& base) {
  ColorConfig color = base.color;
  color.white_balance = false;  // the light is in the colours
  cv::Mat mask = cv::Mat::zeros(bgr.size(), CV_8U);
  cv::circle(mask, at, kPatch, 255, cv::FILLED);
  for (int i = 0; i < kGrowths; ++i) mask = Grown(bgr, mask, color);
  if (std::string unfit = Unfit(mask); !unfit.empty()) return Refused(std::move(unfit));
  try {
    const Learned learned = LearnDetector({bgr}, {mask}, base);
    const Separation& apart = learned.color.pictures.front();
    if (apart.index < kLeastIndex || learned.overlap < kLeastOverlap)
      return Refused("its colour does not set it apart from what else is in view");
    return {"", learned.config, cv::boundingRect(mask)};
  } catch (const std::exception& e) {  // also OpenCV's own
    return Refused(e.what());
  }
}

}  // namespace chase::perception
