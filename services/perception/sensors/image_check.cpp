#include "services/perception/sensors/image_check.h"

#include <algorithm>
#include <cstring>

namespace chase::perception {

namespace {

constexpr int kStep = 4;  // every so many rows and columns are looked at
constexpr int kDark = 12, kBright = 250;
constexpr double kMostlyBright = 0.7;  // share of pixels that makes an image useless
constexpr int kMissingLevel = 2;
constexpr double kMissingRows = 0.1;  // share of rows that makes an image useless

/// True when the row is black from end to end: what a lost transfer leaves.
bool Missing(const cv::Mat& bgr, int y) {
  const uint8_t* row = bgr.ptr<uint8_t>(y);
  return row[0] <= kMissingLevel &&
         std::memcmp(row, row + 1, static_cast<size_t>(3 * bgr.cols - 1)) == 0;
}

}  // namespace

std::string ImageProblem(const cv::Mat& bgr, const world::Rig& rig) {
  if (bgr.empty() || bgr.type() != CV_8UC3) return "image is not 8 bit with 3 channels";
  if (bgr.cols != rig.width_px || bgr.rows != rig.height_px)
    return "image is " + std::to_string(bgr.cols) + "x" + std::to_string(bgr.rows) +
           ", the calibration says " + std::to_string(rig.width_px) + "x" +
           std::to_string(rig.height_px);
  int seen = 0, bright = 0, highest = 0, missing = 0, rows = 0;
  for (int y = 0; y < bgr.rows; y += kStep) {
    ++rows;
    missing += Missing(bgr, y);
    for (int x = 0; x < bgr.cols; x += kStep) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      const int low = std::min({p[0], p[1], p[2]}), high = std::max({p[0], p[1], p[2]});
      highest = std::max(highest, high);
      bright += low >= kBright;
      ++seen;
    }
  }
  if (highest < kDark) return "image is black";
  if (bright > kMostlyBright * seen) return "image is saturated";
  if (missing > kMissingRows * rows) return "image lacks rows";
  return {};
}

}  // namespace chase::perception
