#include "services/viewer/request.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/world/commands.h"

namespace chase::viewer {
namespace {

using nlohmann::json;

constexpr int64_t kMostAcknowledged = 1000000;
constexpr size_t kMostText = 1024;  // bytes of command and token

/// False when the value is there and is not what it should be.
template <class T>
bool Read(const json& object, const char* name, bool (json::*is)() const noexcept, T* value) {
  const auto it = object.find(name);
  if (it == object.end()) return true;
  if (!((*it).*is)()) return false;
  *value = it->get<T>();
  return true;
}

template <class T>
bool Read(const json& object, const char* name, bool (json::*is)() const noexcept,
          std::optional<T>* value) {
  T read{};
  if (!Read(object, name, is, &read)) return false;
  if (object.contains(name)) *value = read;
  return true;
}

bool ReadWants(const json& object, Request* request) {
  const auto it = object.find("want");
  if (it == object.end()) return true;
  if (!it->is_array()) return false;
  request->wants.emplace();
  for (const json& part : *it) {
    if (!part.is_string()) return false;
    request->wants->push_back(part.get<std::string>());
  }
  return true;
}

bool Same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

}  // namespace

std::optional<Request> ParseRequest(const std::string& text) {
  const json object = json::parse(text, nullptr, false);  // no exceptions
  if (!object.is_object()) return std::nullopt;
  Request request;
  const bool read = Read(object, "ack", &json::is_number_integer, &request.acknowledged) &&
                    ReadWants(object, &request) &&
                    Read(object, "play", &json::is_boolean, &request.play) &&
                    Read(object, "speed", &json::is_number, &request.speed) &&
                    Read(object, "seek", &json::is_number, &request.seek) &&
                    Read(object, "command", &json::is_string, &request.command) &&
                    Read(object, "token", &json::is_string, &request.token) &&
                    Read(object, "utime", &json::is_number_integer, &request.utime);
  if (!read || request.command.size() + request.token.size() > kMostText) return std::nullopt;
  request.acknowledged = std::clamp<int64_t>(request.acknowledged, 0, kMostAcknowledged);
  return request;
}

std::string RefusalOf(const Request& request, const std::string& token) {
  if (token.empty()) return "commands are off: the configuration has no token";
  if (!Same(request.token, token)) return "wrong token";
  if (!world::CommandNamed(request.command)) return "no such command";
  if (world::CommandNamed(request.command) == world::kKillCommand)
    return "not from a page: chase-command kill --force";
  if (world::CommandNamed(request.command) == world::kSelectCommand)
    return "not from a page: chase-command select X Y";
  return "";
}

}  // namespace chase::viewer
