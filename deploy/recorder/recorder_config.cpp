#include "deploy/recorder/recorder_config.h"

#include <fmt/format.h>

#include <cmath>

namespace chase::recorder {

std::string RecorderConfig::Problem() const {
  if (folder.empty()) return "folder is empty; name one, such as .";
  if (name.find('/') != name.npos)
    return "name is " + name + "; it names no folder: that is folder";
  const std::pair<const char*, double> numbers[] = {
      {"rotate_mb", rotate_mb}, {"rotate_minutes", rotate_minutes}, {"keep_free_mb", keep_free_mb}};
  for (const auto& [field, value] : numbers)
    if (!(value >= 0.0 && std::isfinite(value)))
      return fmt::format("{} is {}; it must be 0 or more", field, value);
  return std::isfinite(heavy_minutes) ? "" : "heavy_minutes is not a finite number";
}

}  // namespace chase::recorder
