#include "logs/src/output.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace chase::logs {
namespace {

namespace fs = std::filesystem;

/// The file that `file` links to.
std::string Linked(const std::string& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return file;
  const fs::path linked = fs::canonical(file, ignored);
  return linked.empty() ? file : linked.string();
}

}  // namespace

OutputFile::OutputFile(const std::string& file)
    : file_(file), part_(Linked(file)), out_(part_.name(), std::ios::binary) {
  if (!out_)
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
  std::error_code ignored;  // of a file system that has none
  const fs::file_status before = fs::status(file, ignored);
  if (fs::is_regular_file(before)) fs::permissions(part_.name(), before.permissions(), ignored);
}

void OutputFile::Close() {
  out_.close();
  if (!out_ || !part_.Complete())
    throw std::runtime_error(file_ + ": could not be completed; is the disk full?");
}

void WriteFile(const std::string& file, const std::string& text) {
  OutputFile out(file);
  out.Write(text);
  out.Close();
}

void RequireWritable(const std::string& file) {
  const bus::PartFile part(Linked(file));
  if (fs::is_directory(file) || !std::ofstream(part.name()).is_open())
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
}

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(4 * (bytes.size() + 2) / 3);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(bytes.size() - i, 3);
    unsigned value = 0;
    for (size_t k = 0; k < 3; ++k)
      value = value << 8 | (k < count ? static_cast<uint8_t>(bytes[i + k]) : 0U);
    for (size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[value >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace chase::logs
