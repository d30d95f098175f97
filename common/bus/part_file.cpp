#include "common/bus/part_file.h"

#include <cstdio>
#include <filesystem>

namespace chase::bus {

PartFile::PartFile(const std::string& file) : file_(file), name_(file + ".tmp"), done_(false) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (!exists(status) || is_regular_file(status)) return;
  name_ = file;
  done_ = true;
}

PartFile::~PartFile() {
  if (!done_) std::remove(name_.c_str());
}

bool PartFile::Complete() {
  done_ = done_ || std::rename(name_.c_str(), file_.c_str()) == 0;
  return done_;
}

}  // namespace chase::bus
