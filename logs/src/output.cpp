#include "logs/src/output.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace chase::logs {

OutputFile::OutputFile(const std::string& file)
    : file_(file), part_(file), out_(part_.name(), std::ios::binary) {
  if (!out_)
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
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
  const bus::PartFile part(file);
  if (std::filesystem::is_directory(file) || !std::ofstream(part.name()).is_open())
    throw std::runtime_error(file + ": cannot be written; check the folder and its rights");
}

}  // namespace chase::logs
