#include "deploy/campaign/progress_bar.h"

#include <fmt/format.h>

#include <cstdio>

namespace chase::campaign {

ProgressBar::ProgressBar(size_t total, size_t done, bool quiet)
    : total_(total), done_before_(done), quiet_(quiet) {}

/// Judged by what was flown in this run: what was there before took no time.
std::string ProgressBar::TimeLeft(size_t done) const {
  if (done <= done_before_) return "";
  const double spent =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  return fmt::format("{:.0f} s left", spent / static_cast<double>(done - done_before_) *
                                          static_cast<double>(total_ - done));
}

void ProgressBar::Show(const std::string& last, size_t done, size_t failed) {
  if (quiet_) return;
  constexpr size_t kWidth = 30;
  const size_t filled = total_ > 0 ? kWidth * done / total_ : kWidth;
  const std::string failures = failed > 0 ? fmt::format("{} failed ", failed) : "";
  fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {}/{} {}{:<12} {:<28}", "", filled, "", kWidth - filled,
             done, total_, failures, TimeLeft(done), last);
  if (done == total_) End();
  std::fflush(stderr);
}

void ProgressBar::End() const {
  if (!quiet_) fmt::print(stderr, "\n");
}

}  // namespace chase::campaign
