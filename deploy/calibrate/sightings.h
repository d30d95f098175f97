#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/world/rig.h"
#include "deploy/calibrate/board.h"
#include "deploy/calibrate/lidar_fit.h"

namespace chase::calibrate {

/// Frames of a log that show the board, each with the sweep that was measured about them.
struct Sightings {
  std::vector<cv::Mat> frames;  ///< BGR
  std::vector<Plane> planes;
  long images = 0, sweeps = 0, seen = 0;  ///< read; images with the board
};

/// Reads CAMERA_IMAGE and LIDAR_SCAN from an LCM log. Taken are moments at which the board stood
/// still before the camera for as long as a sweep takes, one in half a second at most. Throws
/// std::runtime_error.
Sightings ReadSightings(const std::string& log, const Board& board, const world::Rig& rig);

}  // namespace chase::calibrate
