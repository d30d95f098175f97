#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "services/perception/perception_config.h"

namespace chase::perception {

struct Hsv {
  double hue_deg, saturation, value;  ///< 0 to 360, 0 to 1, 0 to 1
};

/// Of a colour with channels 0 to 1; grey has hue 0.
Hsv ToHsv(double blue, double green, double red);

/// How much a colour looks like the target's, 0 to 1.
double Score(const ColorConfig& config, const Hsv& color);

/// How much each pixel looks like the target's colour.
class ColorModel {
 public:
  explicit ColorModel(const ColorConfig& config);

  /// 8 bit score per pixel, 0 to 255, after the light's tint is taken out. `bgr`: 8 bit 3 channels.
  cv::Mat Score(const cv::Mat& bgr) const;

  /// Gains of blue, green and red that take the warmth off greyish pixels; ones where there are too
  /// few.
  Eigen::Vector3d Gains(const cv::Mat& bgr) const;

 private:
  ColorConfig config_;
  std::vector<uint8_t> table_;  ///< by 6 bits a channel
};

}  // namespace chase::perception
