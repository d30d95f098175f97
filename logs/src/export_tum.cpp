#include <fmt/format.h>

#include <iterator>
#include <stdexcept>

#include "chase/pose_t.hpp"
#include "logs/src/export.h"
#include "logs/src/log_reader.h"
#include "logs/src/message_types.h"
#include "logs/src/output.h"

namespace chase::logs {

long ExportTum(const std::string& log, const std::string& out) {
  LogReader reader(log);
  std::string text;
  long count = 0;
  pose_t pose;
  for (Event e; reader.Next(&e);) {
    if (e.channel != "POSE" || !DecodeBytes(e.bytes, &pose)) continue;
    const double *p = pose.pos, *q = pose.orientation;
    fmt::format_to(
        std::back_inserter(text), "{:.6f} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
        static_cast<double>(pose.utime) * 1e-6, p[0], p[1], p[2], q[1], q[2], q[3], q[0]);
    ++count;
  }
  if (count == 0)
    throw std::runtime_error(log + ": holds no POSE; export a log that chase-odometry wrote");
  WriteFile(out, text);
  return count;
}

}  // namespace chase::logs
