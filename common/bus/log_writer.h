#pragma once

#include <cstdint>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/part_file.h"

namespace chase::bus {

/// Writes an LCM log beside its final name and renames it when closed, so that a broken run leaves
/// no half log.
class LogWriter {
 public:
  /// Throws std::runtime_error when the file cannot be written.
  explicit LogWriter(const std::string& file);
  void Write(int64_t utime, const std::string& channel, const std::vector<uint8_t>& bytes);
  /// Completes the file; throws std::runtime_error when the disk refused it.
  void Close();

 private:
  std::string file_;
  PartFile part_;
  std::unique_ptr<lcm::LogFile> log_;
  bool failed_ = false;
};

}  // namespace chase::bus
