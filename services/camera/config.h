#pragma once

#include <string>

namespace chase::camera {

struct CameraConfig {
  std::string source = "/dev/video0";  ///< see OpenFrameSource
  double rate_hz = 20.0;
  int width_px = 376;         ///< 0: as it comes
  int height_px = 240;        ///< 0: as it comes
  double exposure = 0.0;      ///< s; 0: as the driver says
  double readout = 0.0;       ///< s
  double stamp_delay = 0.0;   ///< s
  double raw_limit_mb = 1.0;  ///< of an image's bytes
  int jpeg_quality = 90;

  template <class V>
  void Visit(V& v) {
    v("source", source,
      "device (/dev/video0), http:// MJPEG stream, rtsp:// or udp:// stream, gst: and a pipeline, "
      "video file or folder of images");
    v("rate_hz", rate_hz, "frames published a second, at most; a recording is played at it");
    v("width_px", width_px, "of the published image; with height_px 0: as it comes");
    v("height_px", height_px, "of the published image; with width_px 0: as it comes");
    v("exposure", exposure, "of a frame, s; 0: what the driver says");
    v("readout", readout, "from the first row's exposure to the last's, s; 0: global shutter");
    v("stamp_delay", stamp_delay, "from the middle of the exposure to the driver's stamp, s");
    v("raw_limit_mb", raw_limit_mb, "an image of more bytes than this is published as JPEG, MB");
    v("jpeg_quality", jpeg_quality, "of those, 1 to 100");
  }

  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::camera
