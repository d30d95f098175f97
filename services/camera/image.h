#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace chase::camera {

/// The frame as RGB, 8 bits a channel, continuous in memory. `frame` is BGR, BGRA or grey of 8 or
/// 16 bits. With a size it is first cut about its centre to the size's aspect ratio, so that
/// fx = fy stays true, then resized by area. An empty frame, or one of another kind, gives an empty
/// image.
cv::Mat ToRgb(const cv::Mat& frame, int width_px, int height_px);

/// An RGB image as a JPEG file of at most so many bytes, with loss: of this quality, or of the
/// first that fits of its half, its quarter and so on. Empty: none fits.
std::vector<uint8_t> ToJpeg(const cv::Mat& rgb, int quality, std::size_t most_bytes);

}  // namespace chase::camera
