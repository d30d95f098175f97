#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "services/perception/perception_config.h"

namespace chase::perception {

/// How well a range of colours separates one picture's target from its background.
struct Separation {
  double target = 0.0;  ///< true positive rate: share of the target's pixels within the range
  double near = 0.0;    ///< false positive rate: of the background within a target's size around it
  double far = 0.0;     ///< false positive rate: of all of the background
  /// Their balance: the true positive rate over one and the false positives for each pixel of the
  /// target, near it and anywhere. 1: parted wholly.
  double index = 0.0;
  bool used = true;  ///< false: left out, since with it the range separates worse
};

struct LearnedColor {
  ColorConfig config;
  std::vector<Separation> pictures;
};

/// The range of hue, saturation and value that holds the marked pixels of some pictures but for
/// their tails. Each picture counts the same, whatever the target's size in it. A picture without
/// which the range separates all of them better, as one in the dark, is left out. `images` 8 bit
/// BGR, `masks` 8 bit of the same sizes; the rest comes from `base`.
LearnedColor LearnColor(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                        const ColorConfig& base);

}  // namespace chase::perception
