#pragma once

#include <memory>
#include <string>

#include "services/camera/frame_source.h"

namespace chase::camera {

/// MJPEG over HTTP, as ustreamer, mjpg-streamer and IP cameras serve it. The stamp is the header
/// X-Timestamp (seconds since 1970) of each part. Connects, and connects again, when asked for a
/// frame. Throws std::runtime_error on an address that is none.
std::unique_ptr<FrameSource> OpenMjpegSource(const std::string& url);

}  // namespace chase::camera
