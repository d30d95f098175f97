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
  if (!(exposure >= 0.0 && exposure <= 1.0))
    return "exposure " + std::to_string(exposure) + " is not in [0, 1] s";
  if (!(readout >= 0.0 && readout <= 1.0))
    return "readout " + std::to_string(readout) + " is not in [0, 1] s";
  if (!(stamp_delay >= -1.0 && stamp_delay <= 1.0))
    return "stamp_delay " + std::to_string(stamp_delay) + " is not in [-1, 1] s";
  if (!(raw_limit_mb > 0.0 && raw_limit_mb <= 1.5))
    return "raw_limit_mb " + std::to_string(raw_limit_mb) +
           " is not in (0, 1.5]: the bus's receive buffers hold 2 MiB";
  if (jpeg_quality < 1 || jpeg_quality > 100)
    return "jpeg_quality " + std::to_string(jpeg_quality) + " is not in 1..100";
  return "";
}

}  // namespace chase::camera
