#pragma once

#include <memory>

#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/camera/config.h"
#include "services/camera/frame_source.h"

namespace chase::camera {

/// Publishes one frame per tick as CAMERA_IMAGE, stamped with the tick.
class CameraNode : public bus::Node {
 public:
  CameraNode(bus::Bus& bus, const CameraConfig& config);

  int64_t TickPeriod() const override;
  void Tick(int64_t utime) override;
  bool Done() const override { return done_; }
  bus::NodeReport Report() const override;

 private:
  void Miss();
  void Publish(const cv::Mat& rgb, int64_t utime);

  bus::Bus& bus_;
  CameraConfig config_;
  std::unique_ptr<FrameSource> source_;
  long frames_ = 0, misses_ = 0;
  bool done_ = false;
};

}  // namespace chase::camera
