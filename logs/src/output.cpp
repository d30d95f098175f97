#include "logs/src/output.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace chase::logs {

void WriteFile(const std::string& file, const std::string& text) {
  bus::PartFile part(file);
  std::ofstream out(part.name(), std::ios::binary);
  if (!out) throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
  out << text;
  out.close();
  if (out && part.Complete()) return;
  throw std::runtime_error(file + ": could not be completed; is the disk full?");
}

void RequireWritable(const std::string& file) {
  const bus::PartFile part(file);
  if (std::filesystem::is_directory(file) || !std::ofstream(part.name()).is_open())
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
}

}  // namespace chase::logs
