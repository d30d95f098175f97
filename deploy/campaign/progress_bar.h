#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace chase::campaign {

/// The bar on stderr: flights done, failed so far, time left.
class ProgressBar {
 public:
  ProgressBar(size_t total, size_t done, bool quiet);

  void Show(const std::string& last, size_t done, size_t failed);
  void End() const;

 private:
  std::string TimeLeft(size_t done) const;

  size_t total_, done_before_;
  bool quiet_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace chase::campaign
