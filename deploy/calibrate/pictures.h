#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "deploy/calibrate/board.h"
#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/imu_fit.h"
#include "deploy/calibrate/lidar_fit.h"
#include "deploy/calibrate/sightings.h"

namespace chase::calibrate {

/// Every corner of every view where it was found, with its error drawn 20 times: arrows that point
/// alike in one part of the picture are a lens that the fit does not have, empty parts were never
/// looked at.
cv::Mat CameraPicture(const std::vector<View>& views, const world::Rig& rig);

/// Each frame with the points that the fit used, by the pose found (green) and by the one before
/// (red): green has to lie on the board.
cv::Mat LidarPicture(const Sightings& sightings, const LidarFit& fit,
                     const Eigen::Isometry3d& before, const world::Rig& rig);

/// The turns about each axis of C over time, by the camera (dots) and by the gyroscope with the fit
/// (green), and what they differ by, drawn 20 times (red): dots have to lie on the line, and red to
/// be noise. Empty where none were compared.
cv::Mat ImuPicture(const ImuFit& fit);

}  // namespace chase::calibrate
