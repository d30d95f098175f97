#pragma once

#include <opencv2/core.hpp>

namespace chase::camera {

/// The frame as RGB, 8 bits a channel, continuous in memory. `frame` is BGR, BGRA or grey of 8 or
/// 16 bits. With a size it is first cut about its centre to the size's aspect ratio, so that
/// fx = fy stays true, then resized by area. An empty frame, or one of another kind, gives an empty
/// image.
cv::Mat ToRgb(const cv::Mat& frame, int width_px, int height_px);

}  // namespace chase::camera
