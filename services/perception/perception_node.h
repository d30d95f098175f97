#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "chase/camera_image_t.hpp"
#include "chase/command_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/selection_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "common/world/command_window.h"
#include "services/perception/belief/perceiver.h"

namespace chase::perception {

/// CAMERA_IMAGE, LIDAR_SCAN, POSE, COMMAND and SELECTION_KEPT in, TARGET, COMMAND_ACK and SELECTION
/// out; every image triggers, and is answered for its own time.
class PerceptionNode : public bus::Node {
 public:
  PerceptionNode(bus::Bus& bus, const PerceptionConfig& config);
  bus::NodeReport Report() const override;

 private:
  void OnImage(const camera_image_t& message);
  void OnScan(const lidar_scan_t& message);
  void OnPose(const pose_t& message);
  void OnCommand(const command_t& message);
  void OnKept(const selection_t& message);
  void TellSelection();
  world::CommandAnswer Select(const command_t& message);
  int64_t Origin(int64_t utime);

  bus::Bus& bus_;
  PerceptionConfig config_;
  std::unique_ptr<Perceiver> perceiver_;
  bus::Epoch epoch_;
  std::string Reasons() const;

  Refused refused_ = {};       ///< since the start
  int64_t unused_frames_ = 0;  ///< likewise
  std::optional<TargetEstimate> last_;
  Frame frame_;              ///< the last one
  int64_t frame_heard_ = 0;  ///< utime; 0: none yet
  world::CommandWindow window_;
  bool selected_ = false;          ///< config_'s detector is what an operator selected
  int64_t selection_told_ = 0;     ///< utime
  std::optional<int64_t> origin_;  ///< utime that the core's seconds count from
};

}  // namespace chase::perception
