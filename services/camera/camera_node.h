#pragma once

#include <memory>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/host_clock.h"
#include "common/bus/node.h"
#include "services/camera/capture_clock.h"
#include "services/camera/config.h"
#include "services/camera/frame_source.h"
#include "services/camera/grabber.h"
#include "services/camera/pace.h"

namespace chase::camera {

/// Publishes frames as CAMERA_IMAGE: a device's when they come, with the time at which they were
/// captured; a recording's one per tick, stamped with the tick.
class CameraNode : public bus::Node {
 public:
  CameraNode(bus::Bus& bus, const CameraConfig& config);

  int64_t TickPeriod() const override;
  void Tick(int64_t utime) override;
  bool Done() const override { return done_; }
  bus::NodeReport Report() const override;

 private:
  void TickRecording(int64_t utime);
  void TickDevice();
  void TakeFrame(const Grabber::Grabbed& grabbed);
  int64_t CaptureTime(const Grabber::Grabbed& grabbed);
  void Publish(const Frame& frame, int64_t utime);
  void Measure();
  double Silence() const;
  std::string StampWords() const;

  bus::Bus& bus_;
  CameraConfig config_;
  std::unique_ptr<FrameSource> recording_;  // or
  std::unique_ptr<Grabber> grabber_;
  CaptureClock clock_;
  bus::WallClockWatch wall_;
  Pace pace_;
  StampClock stamps_ = StampClock::kNone;
  int64_t last_utime_ = 0, last_picture_ = 0;  // bus's clock
  double age_ = 0.0;                           // of the last frame when published, s
  double rate_ = 0.0;                          // published, Hz; 0: not measured yet
  int64_t rated_ = 0;                          // when it was measured
  long rated_frames_ = 0;                      // published until then
  long frames_ = 0, unusable_ = 0, surplus_ = 0, backwards_ = 0;
  bool done_ = false;
};

}  // namespace chase::camera
