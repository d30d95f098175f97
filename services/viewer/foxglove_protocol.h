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
/// `services`: there are some.
std::string ServerInfoText(const std::string& name, const std::string& session, bool services);
std::string AdvertiseText(const std::vector<FoxgloveChannel>& channels);

/// Message of a subscription: opcode 1, uint32 subscription, uint64 nanoseconds, payload; little
/// endian.
std::string MessageData(uint32_t subscription, int64_t utime, const std::string& payload);

/// The one service, "command": JSON {command, token, utime} in, {accepted, words} out. `utime`, of
/// the newest message that the caller has seen [us], may be left out.
std::string AdvertiseServiceText();
/// A client's binary message: opcode 2, uint32 service, uint32 call, uint32 length of the
/// encoding's name, that name, payload; little endian. Nothing when it is no call of ours in JSON.
struct ServiceCall {
  uint32_t call = 0;
  std::string payload;
};
std::optional<ServiceCall> ServiceCallOf(const std::string& bytes);
/// The answer, likewise with opcode 3. `refusal`: empty where the vehicle has taken the command.
std::string CommandAnswer(uint32_t call, const std::string& refusal, const std::string& words);
/// The payload is not what the service takes.
std::string CallFailureText(const ServiceCall& call);

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
