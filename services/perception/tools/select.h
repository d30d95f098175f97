#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "services/perception/perception_config.h"

namespace chase::perception {

/// What somebody points at in a picture, learned as a target.
struct Selection {
  std::string refusal;    ///< why it cannot be one; empty: it can
  DetectorConfig config;  ///< finds it by its colour and shape
  cv::Rect box;           ///< of it in the picture, px
};

/// Learns the thing that shows at pixel `at` of an 8 bit BGR picture: the patch around it grows
/// over what has its colour and is connected. Refused where the picture cuts the thing, where it is
/// too small or large, and where its colour does not set it apart. The rest comes from `base`.
Selection LearnAt(const cv::Mat& bgr, const cv::Point& at, const DetectorConfig& base);

}  // namespace chase::perception
