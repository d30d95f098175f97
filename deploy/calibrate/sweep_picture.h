#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "common/world/rig.h"

namespace chase::calibrate {

/// A frame of a log with one sweep's LiDAR points, coloured by range: edges in the points must lie
/// on edges in the picture when the calibration holds. The frame is the first readable one `at`
/// seconds or more after the log's first image, the sweep the newest logged between it and a pose
/// for it: the next one where that is there already. Points at whose time no pose is known are left
/// out. Throws std::runtime_error.
cv::Mat SweepPicture(const std::string& log, const world::Rig& rig, double at);

}  // namespace chase::calibrate
