#pragma once

#include <string>

#include "chase/camera_image_t.hpp"

namespace chase::logs {

inline constexpr int kJpegQuality = 90;  ///< of 100: at a twentieth of the raw size; no sweep

/// The image as a JPEG file, with loss where it is not one already; empty when the message does not
/// hold the pixels that it says.
std::string Jpeg(const camera_image_t& message, int quality = kJpegQuality);

}  // namespace chase::logs
