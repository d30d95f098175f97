#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace chase::viewer {

/// What a page, or a client of Foxglove's by a service, asks for. Several may stand in one message.
struct Request {
  int64_t acknowledged = 0;                       ///< frames taken since the last request
  std::optional<std::vector<std::string>> wants;  ///< heavy parts: "cloud", "image"
  bool looks = false;  ///< at more than before: it lacks what others have been sent
  std::optional<bool> play;
  std::optional<double> speed, seek;  ///< seek: s from the log's beginning
  std::string command, token;         ///< command: empty where there is none
  std::optional<int64_t> utime;       ///< of the newest state that who commands has seen
  uint64_t caller = 0;                ///< number of the client that asks
  uint32_t call = 0;                  ///< its number of the call, by a service of Foxglove's
};

/// Nothing when the text is no request: other JSON, none at all, or values of other types.
std::optional<Request> ParseRequest(const std::string& text);

/// Empty when a command, other than kill, with this token may be passed on, else why not. The
/// comparison takes as long for every token of the same length.
std::string RefusalOf(const Request& request, const std::string& token);

}  // namespace chase::viewer
