#pragma once

#include <string>
#include <vector>

#include "services/viewer/page_sink.h"

namespace chase::viewer {

/// What a page is told while a log is played from its beginning to its end, for a report that plays
/// it without a viewer.
struct Recording {
  struct Frame {
    Part part;
    double t = 0.0;     ///< s from the log's beginning
    std::string bytes;  ///< as a page gets them: a text, or binary of sweeps and images
  };
  double duration = 0.0;  ///< s
  std::string hello;
  std::vector<Frame> frames;  ///< in their order
};

/// At most 1200 states, 200 images and 100 sweeps, however long the log is. Throws
/// std::runtime_error with one line.
Recording RecordLog(const std::string& log);

}  // namespace chase::viewer
