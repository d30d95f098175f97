#include "common/bus/default_url.h"

#include <cstdlib>
#include <fstream>

namespace chase::bus {
namespace {

namespace fs = std::filesystem;

/// Of <prefix>/bin beside the package's <prefix>/share/chase.
bool IsInstalled() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return !error && fs::exists(program.parent_path().parent_path() / "share" / "chase", error);
}

}  // namespace

std::string UrlOf(const fs::path& environment) {
  const std::string key = "LCM_DEFAULT_URL=", around = " \t\r\"'";
  std::ifstream file(environment);
  std::string url;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const size_t begin = line.find_first_not_of(around, key.size());
    const size_t end = line.find_last_not_of(around);
    url = begin == std::string::npos ? "" : line.substr(begin, end + 1 - begin);
  }
  return url;
}

std::string DefaultUrl() {
  const char* told = std::getenv("LCM_DEFAULT_URL");
  if (told != nullptr && *told != '\0') return told;
  const std::string units = IsInstalled() ? UrlOf("/etc/chase/environment") : "";
  return units.empty() ? kDefaultUrl : units;
}

}  // namespace chase::bus
