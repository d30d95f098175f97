#pragma once

#include <string>

namespace chase::camera {

struct CameraConfig {
  std::string source = "/dev/video0";  ///< device, video file or folder of images
  double rate_hz = 20.0;
  int width_px = 376;   ///< 0: as it comes
  int height_px = 240;  ///< 0: as it comes

  template <class V>
  void Visit(V& v) {
    v("source", source, "device (/dev/video0), video file or folder of images");
    v("rate_hz", rate_hz, "frames published a second");
    v("width_px", width_px, "of the published image; with height_px 0: as it comes");
    v("height_px", height_px, "of the published image; with width_px 0: as it comes");
  }

  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::camera
