#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace chase::logs {

/// What chase-viewer's page plays of a log, for services/viewer/page/recording.js: {begin,
/// duration, hello, frames}. `begin`: time of the log's first event in the report's time, s. Throws
/// std::runtime_error with one line.
nlohmann::ordered_json PlaybackOf(const std::string& log, double begin);

/// The viewer's page: its files by name, gzip as base64. Null where there is none beside bin/.
nlohmann::ordered_json PlaybackPage(const std::string& share_folder);

}  // namespace chase::logs
