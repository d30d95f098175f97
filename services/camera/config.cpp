#include "services/camera/config.h"

namespace chase::camera {

std::string CameraConfig::Problem() const {
  if (source.empty()) return "source is empty; name a device, a video file or a folder";
  if (!(rate_hz > 0.0 && rate_hz <= 1000.0))
    return "rate_hz " + std::to_string(rate_hz) + " is not in (0, 1000]";
  if (width_px < 0 || height_px < 0 || width_px > 8192 || height_px > 8192)
    return "width_px " + std::to_string(width_px) + " and height_px " + std::to_string(height_px) +
           " must be in 0..8192";
  if ((width_px == 0) != (height_px == 0))
    return "width_px " + std::to_string(width_px) + " and height_px " + std::to_string(height_px) +
           " must both be 0 or both be positive";
  return "";
}

}  // namespace chase::camera
