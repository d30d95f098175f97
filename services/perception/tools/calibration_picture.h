#pragma once

#include <string>

namespace chase::perception {

/// Draws one sweep's LiDAR points into a frame, coloured by range: edges in the points must lie on
/// edges in the picture when the calibration holds. The frame is the first readable one at or after
/// `at`, the sweep the newest logged between it and a pose for it: the next one where that is there
/// already. Points at whose time no pose is known are left out. Reads CAMERA_IMAGE, LIDAR_SCAN and
/// POSE from the log `in` and writes the picture `out`. Throws std::runtime_error.
/// `chase-perception --check-calibration LOG --out PNG [--at S] [--config FILE]`; `at` counts
/// seconds from the log's first image.
void WriteCalibrationPicture(const std::string& in, const std::string& out,
                             const std::string& config_file, double at);

/// The flags above; exit code 0, or 1 after one line on stderr.
int CheckCalibration(int argc, char** argv);

}  // namespace chase::perception
