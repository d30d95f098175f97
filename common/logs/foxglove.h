#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/logs/log_reader.h"
#include "common/logs/schema.h"
#include "common/world/rig.h"

namespace chase::logs {

/// Foxglove's schemas (docs.foxglove.dev/docs/sdk/schemas) as far as they are used, every member in
/// the order of its protobuf number. `n` stands for the length of any list.
const Schema& FoxgloveTypes();

/// A message for viewers.
struct ViewerMessage {
  std::string topic, schema;  ///< schema: "foxglove.PointCloud", or "chase.pose_t"
  std::string bytes;          ///< protobuf
};

struct ViewerOptions {
  bool jpeg = false;                            ///< images lossy, at a twentieth of the size
  world::Rig rig;                               ///< that flew: no message tells it
  std::map<std::string, double> hard_radius{};  ///< of each vehicle's last PLAN, m
};

/// What a viewer shows of a message. Clouds and images become Foxglove's own; every other message
/// keeps its fields, and beside it, on topics CHANNEL/pose, CHANNEL/scene, OBSTACLES/grown, /tf and
/// so on, there is what Foxglove draws. Nothing when the type is not ours or the bytes do not
/// decode.
std::vector<ViewerMessage> ToViewer(const LogEvent& event, const ViewerOptions& options);

/// What describes a message of that name, as a FileDescriptorSet.
std::string DescriptorsOf(const std::string& schema);

}  // namespace chase::logs
