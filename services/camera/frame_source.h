#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace chase::camera {

/// Where frames come from.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame as OpenCV gives it (BGR), or nothing when there is none.
  virtual std::optional<cv::Mat> Next() = 0;
  /// True when it has an end; a device has none.
  virtual bool IsRecording() const = 0;
};

/// A device (/dev/video0), a video file or a folder of images in the order of their names. Throws
/// std::runtime_error with one line that says what, where and how to mend it.
std::unique_ptr<FrameSource> OpenFrameSource(const std::string& source, double rate_hz);

}  // namespace chase::camera
