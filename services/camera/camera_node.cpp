#include "services/camera/camera_node.h"

#include <cmath>

#include "services/camera/image.h"

namespace chase::camera {

CameraNode::CameraNode(bus::Bus& bus, const CameraConfig& config)
    : bus_(bus), config_(config), source_(OpenFrameSource(config.source, config.rate_hz)) {}

int64_t CameraNode::TickPeriod() const { return std::llround(1e6 / config_.rate_hz); }

void CameraNode::Tick(int64_t utime) {
  if (done_) return;
  cv::Mat rgb;
  {
    auto timer = bus_.Time("grab");
    if (const auto frame = source_->Next())
      rgb = ToRgb(*frame, config_.width_px, config_.height_px);
  }
  if (rgb.empty()) return Miss();
  Publish(rgb, utime);
}

void CameraNode::Miss() {
  if (source_->IsRecording()) {
    done_ = true;
    return;
  }
  ++misses_;
  bus_.ReportError(config_.source + ": no frame; check the cable");
}

void CameraNode::Publish(const cv::Mat& rgb, int64_t utime) {
  camera_image_t m{};
  m.utime = utime;
  m.width = rgb.cols;
  m.height = rgb.rows;
  m.row_stride = 3 * rgb.cols;
  m.pixelformat = camera_image_t::PIXEL_FORMAT_RGB;
  m.exposure = 0.0;
  m.size = m.row_stride * m.height;
  m.data.assign(rgb.datastart, rgb.dataend);
  bus_.Publish("CAMERA_IMAGE", std::move(m));
  ++frames_;
}

bus::NodeReport CameraNode::Report() const {
  using State = bus::NodeReport::State;
  if (frames_ == 0) return {State::kStarting, "no frame yet"};
  return {misses_ > 0 ? State::kDegraded : State::kOk,
          std::to_string(frames_) + " frames, " + std::to_string(misses_) + " missed"};
}

}  // namespace chase::camera
