#include "deploy/campaign/text_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "common/world/scenario.h"

namespace chase::campaign {

void WriteText(const std::string& file, const std::string& text) {
  const std::string temporary = file + "." + std::to_string(getpid()) + ".tmp";
  std::ofstream out(temporary, std::ios::binary);
  out << text;
  out.close();
  std::error_code error;
  // Never over a device such as /dev/null: a rename would replace it.
  const bool special = std::filesystem::exists(file) && !std::filesystem::is_regular_file(file);
  if (out && !special) std::filesystem::rename(temporary, file, error);
  if (!out || special || error) {
    std::filesystem::remove(temporary, error);
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
  }
}

std::string ReadText(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be read; check the path and its rights");
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string ScenarioText(const std::string& file) {
  const std::string path = world::LoadScenario(file).target.path_file;
  return ReadText(file) + (path.empty() ? "" : ReadText(path));
}

std::string Fingerprint(const std::vector<std::string>& texts) {
  uint64_t hash = 0xcbf29ce484222325ull;
  const auto add = [&](char c) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  };
  for (const std::string& text : texts) {
    for (const char c : text) add(c);
    add('\0');  // "ab", "c" is not "a", "bc"
  }
  return fmt::format("{:016x}", hash);
}

std::string ThisProgram() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

}  // namespace chase::campaign
