#pragma once

#include <string>

namespace chase::bus {

/// The file that is written in place of another until that is complete, so that nobody ever sees
/// half a file: FILE.tmp, renamed in the end. A device or a pipe is written itself, since a rename
/// would replace it.
class PartFile {
 public:
  explicit PartFile(const std::string& file);
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;
  /// Removes what was not completed.
  ~PartFile();

  const std::string& name() const { return name_; }
  /// False when the file system refuses.
  bool Complete();

 private:
  std::string file_, name_;
  bool done_;
};

}  // namespace chase::bus
