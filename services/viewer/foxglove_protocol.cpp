#include "services/viewer/foxglove_protocol.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

namespace chase::viewer {
namespace {

using nlohmann::json;

constexpr uint32_t kService = 1;
constexpr std::string_view kEncoding = "json";
constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string Text(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

template <class T>
void LittleEndian(T value, std::string* out) {
  for (size_t i = 0; i < sizeof(T); ++i) out->push_back(static_cast<char>(value >> (8 * i) & 0xff));
}

uint32_t ReadLittleEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 4; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

/// Of an object with these members, as a JSON schema.
json ObjectOf(const json& members) {
  const std::string schema = Text({{"type", "object"}, {"properties", members}});
  return {{"encoding", kEncoding},
          {"schemaName", "chase.command"},
          {"schemaEncoding", "jsonschema"},
          {"schema", schema}};
}

std::string Warning(const std::string& what) {
  return Text({{"op", "status"}, {"level", 1}, {"message", what}});
}

const json& Member(const json& object, const char* name) {
  static const json none;
  const auto it = object.find(name);
  return it == object.end() ? none : *it;
}

std::optional<uint32_t> Id(const json& value) {
  if (!value.is_number_unsigned() || value.get<uint64_t>() > UINT32_MAX) return std::nullopt;
  return value.get<uint32_t>();
}

std::string ParameterValues(const json& request, const Parameters& parameters) {
  const json& names = Member(request, "parameterNames");
  json values = json::array();
  for (const auto& [name, value] : parameters)
    if (!names.is_array() || names.empty() ||
        std::find(names.begin(), names.end(), name) != names.end())
      values.push_back({{"name", name}, {"value", value}});
  json answer = {{"op", "parameterValues"}, {"parameters", values}};
  if (Member(request, "id").is_string()) answer["id"] = request["id"];
  return Text(answer);
}

}  // namespace

std::string Base64(const std::string& bytes) {
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0U);
    for (size_t k = 0; k < 4; ++k)
      out.push_back(i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63]);
  }
  return out;
}

std::string ServerInfoText(const std::string& name, const std::string& session, bool services) {
  json capabilities = json::array({"parameters"}), encodings = json::array();
  if (services) {
    capabilities.push_back("services");
    encodings.push_back(kEncoding);
  }
  return Text({{"op", "serverInfo"},
               {"name", name},
               {"capabilities", capabilities},
               {"supportedEncodings", encodings},
               {"metadata", json::object()},
               {"sessionId", session}});
}

std::string AdvertiseText(const std::vector<FoxgloveChannel>& channels) {
  json rows = json::array();
  for (const FoxgloveChannel& c : channels)
    rows.push_back({{"id", c.id},
                    {"topic", c.topic},
                    {"encoding", "protobuf"},
                    {"schemaName", c.schema_name},
                    {"schema", Base64(c.descriptors)},
                    {"schemaEncoding", "protobuf"}});
  return Text({{"op", "advertise"}, {"channels", rows}});
}

std::string AdvertiseServiceText() {
  const json text = {{"type", "string"}}, truth = {{"type", "boolean"}};
  const json number = {{"type", "integer"}};
  const json service = {
      {"id", kService},
      {"name", "command"},
      {"type", "chase.command"},
      {"request", ObjectOf({{"command", text}, {"token", text}, {"utime", number}})},
      {"response", ObjectOf({{"accepted", truth}, {"words", text}})}};
  return Text({{"op", "advertiseServices"}, {"services", json::array({service})}});
}

std::optional<ServiceCall> ServiceCallOf(const std::string& bytes) {
  constexpr size_t kHead = 13;  // opcode and three numbers
  const size_t payload = kHead + kEncoding.size();
  if (bytes.size() < payload || bytes[0] != '\2' || ReadLittleEndian(bytes, 1) != kService ||
      ReadLittleEndian(bytes, 9) != kEncoding.size() ||
      bytes.compare(kHead, kEncoding.size(), kEncoding) != 0)
    return std::nullopt;
  return ServiceCall{ReadLittleEndian(bytes, 5), bytes.substr(payload)};
}

std::string CommandAnswer(uint32_t call, const std::string& refusal, const std::string& words) {
  std::string out(1, '\3');
  for (const uint32_t number : {kService, call, static_cast<uint32_t>(kEncoding.size())})
    LittleEndian(number, &out);
  return out.append(kEncoding) +
         Text({{"accepted", refusal.empty()}, {"words", refusal.empty() ? words : refusal}});
}

std::string CallFailureText(const ServiceCall& call) {
  return Text({{"op", "serviceCallFailure"},
               {"serviceId", kService},
               {"callId", call.call},
               {"message", "not {command, token}"}});
}

std::string MessageData(uint32_t subscription, int64_t utime, const std::string& payload) {
  std::string out(1, '\1');
  LittleEndian(subscription, &out);
  LittleEndian(static_cast<uint64_t>(utime) * 1000U, &out);
  return out + payload;
}

std::string FoxgloveClient::Hear(const std::string& text) {
  const json request = json::parse(text, nullptr, false);
  if (!request.is_object() || !Member(request, "op").is_string()) return Warning("not understood");
  const auto op = request["op"].get<std::string>();
  if (op == "subscribe") {
    for (const json& s : Member(request, "subscriptions")) {
      const auto id = s.is_object() ? Id(Member(s, "id")) : std::nullopt;
      const auto channel = s.is_object() ? Id(Member(s, "channelId")) : std::nullopt;
      if (!id || !channel) return Warning("a subscription needs id and channelId");
      if (channels_.size() >= kMostSubscriptions) return Warning("too many subscriptions");
      channels_[*id] = *channel;
    }
    return "";
  }
  if (op == "unsubscribe") {
    for (const json& id : Member(request, "subscriptionIds"))
      if (const auto subscription = Id(id)) channels_.erase(*subscription);
    return "";
  }
  if (op == "getParameters") return ParameterValues(request, *parameters_);
  if (op == "subscribeParameterUpdates" || op == "unsubscribeParameterUpdates") return "";
  return Warning(op + ": this server only shows");
}

}  // namespace chase::viewer
