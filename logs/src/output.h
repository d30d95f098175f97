#pragma once

#include <fstream>
#include <string>

#include "common/bus/log_writer.h"

namespace chase::logs {

/// A file that is written beside its name and appears under it when closed; where there is one, its
/// permissions stay, and a link to it stays a link. Throws std::runtime_error with one line.
class OutputFile {
 public:
  explicit OutputFile(const std::string& file);
  void Write(const std::string& text) { out_ << text; }
  void Close();

 private:
  std::string file_;
  bus::PartFile part_;
  std::ofstream out_;
};

/// Writes `text` as an OutputFile, so that nobody ever sees half a file. Throws std::runtime_error
/// with one line.
void WriteFile(const std::string& file, const std::string& text);

/// Bytes as text (RFC 4648, section 4).
std::string Base64(const std::string& bytes);

/// Throws what WriteFile would throw, before there is anything to write: for a file that is asked
/// for at the start and written at the end.
void RequireWritable(const std::string& file);

/// A log that appears under its name when closed and leaves nothing behind when not.
class OutputLog {
 public:
  explicit OutputLog(const std::string& file) : writer_(file) {}

  template <class T>
  void Write(int64_t utime, const std::string& channel, const T& message) {
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    writer_.Write(utime, channel, bytes);
  }
  void Close() { writer_.Close(); }

 private:
  bus::LogWriter writer_;
};

}  // namespace chase::logs
