#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "logs/src/message_types.h"

namespace chase::logs {

/// A message as JSON for viewers, and the name of its schema.
struct ViewerMessage {
  std::string schema;  ///< "chase.pose_t", or one of Foxglove's for clouds and images
  nlohmann::ordered_json json;
};

/// Clouds become foxglove.PointCloud, images foxglove.RawImage; every other type keeps its own
/// fields. Nothing when the type is not ours or the bytes do not decode.
std::optional<ViewerMessage> ToViewer(const Bytes& message);

/// A JSON schema that describes `example`.
nlohmann::ordered_json SchemaOf(const nlohmann::ordered_json& example);

}  // namespace chase::logs
