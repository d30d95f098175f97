#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "common/world/rig.h"

namespace chase::perception {

/// What makes an image unusable (type, size, too dark, too bright, rows missing) as a short
/// sentence, or an empty string.
std::string ImageProblem(const cv::Mat& bgr, const world::Rig& rig);

}  // namespace chase::perception
