#include "logs/src/playback.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "logs/src/output.h"
#include "services/viewer/recording.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;
using viewer::Part;

Json FrameOf(const viewer::Recording::Frame& frame) {
  const double t = std::round(frame.t * 1e3) / 1e3;
  if (frame.part == Part::kCloud) return {"cloud", t, Base64(frame.bytes)};
  if (frame.part == Part::kImage) return {"image", t, Base64(frame.bytes)};
  Json message = Json::parse(frame.bytes);
  return {message["type"], t, message};
}

}  // namespace

Json PlaybackOf(const std::string& log, double begin) {
  const viewer::Recording recording = viewer::RecordLog(log);
  Json frames = Json::array();
  for (const auto& frame : recording.frames) frames.push_back(FrameOf(frame));
  return {{"begin", begin},
          {"duration", recording.duration},
          {"hello", Json::parse(recording.hello)},
          {"frames", std::move(frames)}};
}

Json PlaybackPage(const std::string& share_folder) {
  namespace fs = std::filesystem;
  Json files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(fs::path(share_folder) / "viewer", none)) {
    if (entry.path().extension() != ".gz") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    files[entry.path().stem().string()] = Base64({std::istreambuf_iterator<char>(file), {}});
  }
  return files.contains("three.module.min.js") ? files : Json();
}

}  // namespace chase::logs
