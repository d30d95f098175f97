#include "services/camera/camera_node.h"

#include <fmt/format.h>

#include <cmath>

#include "chase/camera_image_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/host_clock.h"
#include "common/bus/image_format.h"
#include "services/camera/image.h"

namespace chase::camera {
namespace {

constexpr int64_t kPoll = 5'000;               // us
constexpr int64_t kRateOver = 5'000'000;       // us over which the published rate is measured
constexpr std::size_t kMostBytes = 1'500'000;  // of an image: receive buffers hold 2 MiB
constexpr double kSilent = 0.3;                // s without a frame, or three of its periods

}  // namespace

CameraNode::CameraNode(bus::Bus& bus, const CameraConfig& config)
    : bus_(bus), config_(config), pace_(std::llround(1e6 / config.rate_hz)) {
  auto source = OpenFrameSource(config);
  if (source->IsRecording())
    recording_ = std::move(source);
  else
    grabber_ = std::make_unique<Grabber>(std::move(source));
}

int64_t CameraNode::TickPeriod() const {
  return grabber_ ? kPoll : std::llround(1e6 / config_.rate_hz);
}

void CameraNode::Tick(int64_t utime) {
  if (done_) return;
  if (grabber_)
    TickDevice();
  else
    TickRecording(utime);
}

void CameraNode::TickRecording(int64_t utime) {
  const auto frame = recording_->Next();
  if (frame)
    Publish(*frame, utime);
  else
    done_ = true;
}

void CameraNode::TickDevice() {
  if (last_picture_ == 0) last_picture_ = bus_.Now();  // silent since the start
  if (const auto grabbed = grabber_->Take()) TakeFrame(*grabbed);
  if (const std::string problem = grabber_->Problem(); !problem.empty()) bus_.ReportError(problem);
}

void CameraNode::TakeFrame(const Grabber::Grabbed& grabbed) {
  const int64_t utime = CaptureTime(grabbed);
  if (frames_ > 0 && utime <= last_utime_) {
    ++backwards_;
    // A source that began anew, perhaps on another clock.
    if (last_utime_ - utime < 1'000'000) return;
    pace_.Restart();
  }
  if (pace_.Take(utime))
    Publish(grabbed.frame, utime);
  else
    ++surplus_;
}

/// The middle of the exposure, on the bus's clock.
int64_t CameraNode::CaptureTime(const Grabber::Grabbed& grabbed) {
  const int64_t now = bus_.Now();
  const int64_t arrival = now - (bus::SteadyMicroseconds() - grabbed.arrival);
  const int64_t delay = std::llround(1e6 * config_.stamp_delay);
  const Frame& frame = grabbed.frame;
  stamps_ = frame.clock;
  switch (frame.clock) {
    case StampClock::kNone:
      return arrival - delay;
    case StampClock::kMonotonic:
      return clock_.HostTime(now - (bus::SteadyMicroseconds() - frame.stamp), true, arrival) -
             delay;
    case StampClock::kWall: {
      const int64_t stamp = now - (bus::WallMicroseconds() - frame.stamp);
      if (wall_.WasSet(CaptureClock::kOldest)) return clock_.WithoutStamp(arrival) - delay;
      return clock_.HostTime(stamp, true, arrival) - delay;
    }
    case StampClock::kStream:
      break;
  }
  return clock_.HostTime(frame.stamp, false, arrival) - delay;
}

void CameraNode::Publish(const Frame& frame, int64_t utime) {
  auto timer = bus_.Time("convert");
  const cv::Mat rgb = ToRgb(frame.bgr, config_.width_px, config_.height_px);
  if (rgb.empty()) {
    ++unusable_;
    return;
  }
  camera_image_t m{};
  m.utime = utime;
  m.width = rgb.cols;
  m.height = rgb.rows;
  m.row_stride = 3 * rgb.cols;
  m.pixelformat = camera_image_t::PIXEL_FORMAT_RGB;
  m.exposure = config_.exposure > 0.0 ? config_.exposure : frame.exposure;
  m.readout = config_.readout;
  if (static_cast<double>(rgb.total() * 3) > 1e6 * config_.raw_limit_mb) {
    m.pixelformat = bus::kPixelFormatMjpeg;
    m.data = ToJpeg(rgb, config_.jpeg_quality, kMostBytes);
  } else {
    m.data.assign(rgb.datastart, rgb.dataend);
  }
  if (m.data.empty()) {
    ++unusable_;
    return;
  }
  m.size = static_cast<int32_t>(m.data.size());
  bus_.Publish("CAMERA_IMAGE", std::move(m));
  last_utime_ = utime;
  last_picture_ = bus_.Now();
  age_ = bus::Seconds(last_picture_, utime);
  ++frames_;
  Measure();
}

void CameraNode::Measure() {
  if (const double s = bus::Seconds(last_picture_, rated_); s >= 1e-6 * kRateOver) {
    rate_ = rated_ == 0 ? 0.0 : static_cast<double>(frames_ - rated_frames_) / s;
    rated_ = last_picture_;
    rated_frames_ = frames_;
  }
}

/// s since the last picture was published.
double CameraNode::Silence() const {
  return last_picture_ == 0 ? 0.0 : bus::Seconds(bus_.Now(), last_picture_);
}

std::string CameraNode::StampWords() const {
  switch (stamps_) {
    case StampClock::kNone:
      return "stamps by arrival";
    case StampClock::kMonotonic:
    case StampClock::kWall:
      return clock_.believed() ? "the driver's stamps"
                               : "the driver's stamps, off this host's clock: aligned by arrival";
    case StampClock::kStream:
      break;
  }
  return "the stream's stamps, aligned by arrival";
}

bus::NodeReport CameraNode::Report() const {
  using State = bus::NodeReport::State;
  if (!grabber_) {
    if (frames_ == 0) return {State::kStarting, "no frame yet"};
    return {State::kOk, fmt::format("{} frames", frames_)};
  }
  const double silence = Silence();
  const std::string why = grabber_->Problem();
  const long undecodable = grabber_->undecodable() + unusable_;
  if (frames_ == 0 && silence < 10.0)
    return {State::kStarting, "no frame yet" + (why.empty() ? "" : "; " + why)};
  if (silence > std::max(kSilent, 3.0 / config_.rate_hz))
    return {State::kFailed,
            fmt::format("{}: no frame for {:.1f} s{}, {} undecodable; check the cable",
                        config_.source, silence, why.empty() ? "" : " (" + why + ")", undecodable)};
  const bool off =
      stamps_ != StampClock::kStream && stamps_ != StampClock::kNone && !clock_.believed();
  return {off ? State::kDegraded : State::kOk,
          fmt::format(
              "{} frames{}, {} dropped, {} undecodable, {} beyond the rate, {} out of order, "
              "{:.0f} ms old; {}",
              frames_, rate_ > 0.0 ? fmt::format(", {:.1f} Hz", rate_) : "", grabber_->dropped(),
              undecodable, surplus_, backwards_, 1e3 * age_, StampWords())};
}

}  // namespace chase::camera
