#include "logs/src/output.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace chase::logs {

void WriteFile(const std::string& file, const std::string& text) {
  const std::string temporary = file + ".tmp";
  std::ofstream out(temporary, std::ios::binary);
  if (!out) throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
  out << text;
  out.close();
  if (out && std::rename(temporary.c_str(), file.c_str()) == 0) return;
  std::remove(temporary.c_str());
  throw std::runtime_error(file + ": could not be completed; is the disk full?");
}

void RequireWritable(const std::string& file) {
  const std::string temporary = file + ".tmp";
  const bool opened = !std::filesystem::is_directory(file) && std::ofstream(temporary).is_open();
  std::remove(temporary.c_str());
  if (!opened)
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
}

OutputLog::~OutputLog() {
  if (!closed_) std::remove((file_ + ".tmp").c_str());
}

void OutputLog::Close() {
  writer_.Close();
  closed_ = true;
}

}  // namespace chase::logs
