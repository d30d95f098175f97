#pragma once

#include <cstdint>

#include "chase/camera_image_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/target_t.hpp"
#include "services/perception/perceiver.h"

namespace chase::perception {

/// The frame in a message; what is not an 8 bit image of known format becomes `problem`.
Frame FromMessage(const camera_image_t& m, int64_t origin);
/// Points that are not finite are left out.
Sweep FromMessage(const lidar_scan_t& m, int64_t origin);
PoseSample FromMessage(const pose_t& m, int64_t origin);
bool Usable(const pose_t& m);
target_t ToMessage(const TargetEstimate& target, int64_t utime);

}  // namespace chase::perception
