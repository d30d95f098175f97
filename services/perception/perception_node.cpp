#include "services/perception/perception_node.h"

#include <fmt/format.h>

#include <array>
#include <opencv2/core.hpp>
#include <string>

#include "services/perception/messages.h"

namespace chase::perception {

PerceptionNode::PerceptionNode(bus::Bus& bus, const PerceptionConfig& config)
    : bus_(bus), config_(config), perceiver_(std::make_unique<Perceiver>(config)) {
  cv::setNumThreads(1);  // the same sums in the same order, and no threads beside the flight's
  bus_.Subscribe<camera_image_t>("CAMERA_IMAGE", [this](const camera_image_t& m) { OnImage(m); });
  bus_.Subscribe<lidar_scan_t>("LIDAR_SCAN", [this](const lidar_scan_t& m) { OnScan(m); });
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
}

void PerceptionNode::OnPose(const pose_t& message) {
  if (!Usable(message)) return;
  if (epoch_.Change(message.epoch)) perceiver_ = std::make_unique<Perceiver>(config_);
  perceiver_->AddPose(FromMessage(message, Origin(message.utime)));
}

void PerceptionNode::OnScan(const lidar_scan_t& message) {
  perceiver_->AddSweep(FromMessage(message, Origin(message.utime)));
}

void PerceptionNode::OnImage(const camera_image_t& message) {
  {
    auto timer = bus_.Time("perceive");
    last_ = perceiver_->See(FromMessage(message, Origin(message.utime)));
  }
  for (size_t i = 0; i < kRefusals; ++i) refused_[i] += last_->refused[i];
  unused_frames_ += !last_->note.empty();
  if (!last_->note.empty()) bus_.ReportError("frame not used: " + last_->note);
  Send(message.utime, *last_);
}

void PerceptionNode::Send(int64_t utime, const TargetEstimate& target) {
  target_t m = ToMessage(target, utime);
  m.epoch = epoch_.value();
  bus_.Publish("TARGET", m);
}

int64_t PerceptionNode::Origin(int64_t utime) {
  if (!origin_) origin_ = utime;
  return *origin_;
}

/// Why nothing was acquired, with counts since the start; empty when nothing was refused.
std::string PerceptionNode::Reasons() const {
  std::string text;
  for (size_t i = 0; i < kRefusals; ++i)
    if (refused_[i] > 0)
      text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", kWhyRefused[i], refused_[i]);
  if (unused_frames_ > 0)
    text += fmt::format("{}frames not used: {}", text.empty() ? "" : "; ", unused_frames_);
  return text;
}

bus::NodeReport PerceptionNode::Report() const {
  using State = bus::NodeReport::State;
  if (!last_) return {State::kStarting, "waiting for an image"};
  if (!last_->note.empty()) return {State::kDegraded, last_->note};
  switch (last_->state) {
    case TargetState::kSearching:
      return {State::kStarting, Reasons().empty()
                                    ? "searching the target, no detection"
                                    : "searching the target; not acquired: " + Reasons()};
    case TargetState::kTracking:
      return {State::kOk, fmt::format("tracking, {} LiDAR points", last_->n_points)};
    case TargetState::kOccluded:
      return {State::kDegraded, "target occluded"};
    case TargetState::kLost:
      break;
  }
  return {State::kDegraded, "target lost"};
}

}  // namespace chase::perception
