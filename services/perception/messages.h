#pragma once

#include <cstdint>

#include "chase/camera_image_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/selection_t.hpp"
#include "chase/target_t.hpp"
#include "services/perception/belief/perceiver.h"

namespace chase::perception {

// Times of the wire, `utime` and `origin`, are microseconds; t of what is returned is seconds from
// `origin`, which is any time near the data, the same for all.

/// The frame in a message; what is not an 8 bit image of known format becomes `problem`.
Frame FromMessage(const camera_image_t& m, int64_t origin);
/// The sweep in a message, t its start; points that are not finite are left out.
Sweep FromMessage(const lidar_scan_t& m, int64_t origin);
PoseSample FromMessage(const pose_t& m, int64_t origin);
/// False when odometry says that the pose is lost or not there yet.
bool Usable(const pose_t& m);
/// The message for an estimate, stamped `utime`, microseconds: its frame's own.
target_t ToMessage(const TargetEstimate& target, int64_t utime);
/// What a detector of kind color has learned of the target.
selection_t ToMessage(const DetectorConfig& learned, int64_t utime);
/// The detector in a message; the rest comes from `base`. Numbers may be beyond their limits.
DetectorConfig FromMessage(const selection_t& m, DetectorConfig base);

}  // namespace chase::perception
