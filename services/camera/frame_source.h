#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "services/camera/config.h"

namespace chase::camera {

/// Which clock a stamp is of.
enum class StampClock {
  kNone,       ///< there is no stamp
  kMonotonic,  ///< this host's monotonic clock, as V4L2 stamps
  kWall,       ///< time since 1970 of whoever sends, as X-Timestamp
  kStream      ///< counts from a beginning that nobody knows, as GStreamer's running time
};

struct Frame {
  cv::Mat bgr;  ///< as OpenCV gives it
  StampClock clock = StampClock::kNone;
  int64_t stamp = 0;      ///< of the capture, on that clock, microseconds
  double exposure = 0.0;  ///< s; 0: not known
};

/// Where frames come from.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, or nothing when there is none: for good (a recording) or for now, after a
  /// second at most; OpenCV 4.6 has no time-out for GStreamer, which may keep the caller for good.
  virtual std::optional<Frame> Next() = 0;
  /// True when it has an end; a device has none.
  virtual bool IsRecording() const = 0;
  /// Why nothing comes, in words; empty: not known.
  virtual std::string Problem() const { return ""; }
};

/// `config.source`: a device (/dev/video0), a video file, a folder of images in the order of their
/// names, http://HOST:PORT/PATH (MJPEG), another URL that FFmpeg reads (rtsp://, udp://), or gst:
/// and a GStreamer pipeline up to its appsink. Throws std::runtime_error with one line that says
/// what, where and how to mend it.
std::unique_ptr<FrameSource> OpenFrameSource(const CameraConfig& config);

}  // namespace chase::camera
