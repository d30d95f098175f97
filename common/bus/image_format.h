#pragma once

#include <cstdint>

namespace chase::bus {

/// camera_image_t's pixelformat of an image whose data is a JPEG file (bot_core's number): for
/// images too large to travel raw. Its row_stride is that of the RGB image within.
inline constexpr int32_t kPixelFormatMjpeg = 1196444237;

}  // namespace chase::bus
