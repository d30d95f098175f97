#include "services/perception/perception_node.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <string>

#include "common/bus/command_call.h"
#include "common/bus/convert.h"
#include "services/perception/messages.h"
#include "services/perception/tools/select.h"

namespace chase::perception {

namespace {

constexpr int64_t kTellPeriod = 1000000;  // us, of what was selected

}  // namespace

PerceptionNode::PerceptionNode(bus::Bus& bus, const PerceptionConfig& config)
    : bus_(bus),
      config_(config),
      perceiver_(std::make_unique<Perceiver>(config)),
      window_("perception", 0.0) {
  cv::setNumThreads(1);  // the same sums in the same order, and no threads beside the flight's
  bus_.Subscribe<camera_image_t>("CAMERA_IMAGE", [this](const camera_image_t& m) { OnImage(m); });
  bus_.Subscribe<lidar_scan_t>("LIDAR_SCAN", [this](const lidar_scan_t& m) { OnScan(m); });
  bus_.Subscribe<command_t>("COMMAND", [this](const command_t& m) { OnCommand(m); });
  bus_.Subscribe<selection_t>("SELECTION_KEPT", [this](const selection_t& m) { OnKept(m); });
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
    frame_ = FromMessage(message, Origin(message.utime));
    last_ = perceiver_->See(frame_);
  }
  frame_heard_ = bus_.Now();
  for (size_t i = 0; i < kRefusals; ++i) refused_[i] += last_->refused[i];
  unused_frames_ += !last_->note.empty();
  if (!last_->note.empty()) bus_.ReportError("frame not used: " + last_->note);
  target_t target = ToMessage(*last_, message.utime);
  target.epoch = epoch_.value();
  bus_.Publish("TARGET", target);
  if (selected_ && std::abs(bus_.Now() - selection_told_) >= kTellPeriod) TellSelection();
}

// The other commands are mission's.
void PerceptionNode::OnCommand(const command_t& message) {
  if (message.kind != command_t::SELECT) return;
  const int64_t start = bus_.identity().start;
  const world::CommandAnswer answer = window_.Take(
      bus::Seconds(bus_.Now(), start), bus::KeyOf(message, start), [&] { return Select(message); });
  bus_.Publish("COMMAND_ACK", bus::Acknowledgement(message, answer, bus_.Now()));
}

world::CommandAnswer PerceptionNode::Select(const command_t& message) {
  if (message.n_arguments != 2) return {false, "select takes a column and a row of the image, px"};
  const double u = message.arguments[0], v = message.arguments[1];
  const double age = bus::Seconds(bus_.Now(), frame_heard_);
  if (frame_heard_ == 0) return {false, "no image has come yet: does the camera run?"};
  if (age > world::kMostAge.target)
    return {false, fmt::format("no image has come for {:.1f} s: does the camera run?", age)};
  if (!frame_.problem.empty()) return {false, "the last image is not usable: " + frame_.problem};
  const cv::Size size = frame_.bgr.size();
  if (!(u >= 0.0 && u <= size.width - 1.0 && v >= 0.0 && v <= size.height - 1.0))
    return {false, fmt::format("({:g}, {:g}) is outside the image: columns 0 to {}, rows 0 to {}",
                               u, v, size.width - 1, size.height - 1)};
  const Selection selection = LearnAt(frame_.bgr, cv::Point2d(u, v), config_.detector);
  if (!selection.refusal.empty()) return {false, selection.refusal};
  config_.detector = selection.config;
  TellSelection();
  perceiver_->Select(selection.config, {u, v});
  const ColorConfig& color = selection.config.color;
  return {true,
          fmt::format("selected: {} x {} px, hue {:.0f} to {:.0f} degrees", selection.box.width,
                      selection.box.height, color.hue_min_deg, color.hue_max_deg)};
}

// Mission keeps it for a process that is started anew, and may be started anew itself.
void PerceptionNode::TellSelection() {
  selected_ = true;
  selection_told_ = bus_.Now();
  bus_.Publish("SELECTION", ToMessage(config_.detector, selection_told_));
}

// What this process was told itself is newer.
void PerceptionNode::OnKept(const selection_t& message) {
  if (selected_) return;
  const DetectorConfig kept = FromMessage(message, config_.detector);
  for (const std::string& problem : {kept.color.Problem(), kept.shape.Problem()})
    if (!problem.empty()) return bus_.ReportError("SELECTION_KEPT: " + problem);
  config_.detector = kept;
  perceiver_ = std::make_unique<Perceiver>(config_);
  TellSelection();
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
