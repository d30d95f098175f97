#pragma once

#include <string>

#include "chase/camera_image_t.hpp"

namespace chase::logs {

/// The image as a JPEG file, with loss; empty when the message does not hold the pixels that it
/// says.
std::string Jpeg(const camera_image_t& message);

}  // namespace chase::logs
