#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "services/perception/perception_config.h"

namespace chase::perception {

/// How much each pixel looks like the target's colour.
class ColorModel {
 public:
  explicit ColorModel(const ColorConfig& config);

  /// 8 bit score per pixel, 0 to 255, after the light's tint is taken out. `bgr`: 8 bit 3 channels.
  cv::Mat Score(const cv::Mat& bgr) const;

  /// Score of one colour, 0 to 1; channels 0 to 1.
  double Score(double blue, double green, double red) const;

  /// Gains of blue, green and red that take the warmth off greyish pixels; ones where there are too
  /// few.
  Eigen::Vector3d Gains(const cv::Mat& bgr) const;

 private:
  ColorConfig config_;
  std::vector<uint8_t> table_;  ///< by 6 bits a channel
};

/// The range of hue, saturation and value that holds the masked pixels of some pictures.
/// `images` 8 bit BGR, `masks` 8 bit of the same sizes; the rest comes from `base`.
ColorConfig LearnColor(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                       const ColorConfig& base);

}  // namespace chase::perception
