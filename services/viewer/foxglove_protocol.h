#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Foxglove's WebSocket protocol (github.com/foxglove/ws-protocol, docs/spec.md) as far as a server
/// needs it that only shows.
namespace chase::viewer {

inline constexpr char kFoxgloveProtocols[2][24] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

struct FoxgloveChannel {
  uint32_t id = 0;
  std::string topic, schema_name, descriptors;  ///< descriptors: a FileDescriptorSet
};

std::string Base64(const std::string& bytes);
std::string ServerInfoText(const std::string& name, const std::string& session);
std::string AdvertiseText(const std::vector<FoxgloveChannel>& channels);

/// Message of a subscription: opcode 1, uint32 subscription, uint64 nanoseconds, payload; little
/// endian.
std::string MessageData(uint32_t subscription, int64_t utime, const std::string& payload);

using Parameters = std::vector<std::pair<std::string, std::string>>;

/// What one client has subscribed to.
class FoxgloveClient {
 public:
  static constexpr size_t kMostSubscriptions = 256;

  explicit FoxgloveClient(const Parameters* parameters) : parameters_(parameters) {}

  /// Takes a text of the client; the answer to it, or an empty string. What is malformed, unknown
  /// or would change something is answered with a status message.
  std::string Hear(const std::string& text);
  /// Subscriptions to a channel.
  const std::map<uint32_t, uint32_t>& channels() const { return channels_; }

 private:
  const Parameters* parameters_;
  std::map<uint32_t, uint32_t> channels_;  // by subscription
};

}  // namespace chase::viewer
