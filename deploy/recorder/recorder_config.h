#pragma once

#include <string>

namespace chase::recorder {

/// Parameters of the recorder.
struct RecorderConfig {
  std::string folder = ".", name;
  double rotate_mb = 1000.0, rotate_minutes = 30.0;
  double heavy_minutes = 10.0;
  double keep_free_mb = 2000.0;

  template <class V>
  void Visit(V& v) {
    v("folder", folder, "that the logs are written into");
    v("name", name, "of the logs, NAME.lcm; empty: the time of the start, UTC");
    v("rotate_mb", rotate_mb, "a log is followed by the next at this size; 0: at none");
    v("rotate_minutes", rotate_minutes, "and after this time; 0: never");
    v("heavy_minutes", heavy_minutes,
      "sweeps, images and maps are kept for so long, in logs of their own; 0: not at all, "
      "negative: "
      "for ever, in the log of all others");
    v("keep_free_mb", keep_free_mb, "of disk below which they are given up, the oldest first");
  }
  std::string Problem() const;
};

}  // namespace chase::recorder
