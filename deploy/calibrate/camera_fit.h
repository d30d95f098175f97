#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/world/rig.h"
#include "deploy/calibrate/board.h"

namespace chase::calibrate {

/// A camera with fx = fy, as the rig has it: a pinhole or, where the corners ask for it, one behind
/// a lens with the radial terms k1 and k2 of OpenCV's plumb_bob.
struct CameraFit {
  std::string problem;  ///< why there is none; empty: there is one
  double focal_px = 0.0, center_u_px = 0.0, center_v_px = 0.0;
  double k1 = 0.0, k2 = 0.0;                     ///< both 0: a pinhole
  double focal_sigma = 0.0, center_sigma = 0.0;  ///< standard deviations, px
  double rms_px = 0.0;                           ///< of the corners
  double pinhole_rms_px = 0.0;                   ///< of the corners by the best pinhole
  /// The rig with this camera, for pictures of that size.
  world::Rig In(world::Rig rig, cv::Size size) const;
};

/// Zhang 2000 through OpenCV, on views of the board in pictures of one size: at least 5, tilted
/// against each other.
CameraFit FitCamera(const std::vector<View>& views, cv::Size size);

/// The board seen by a known camera: rotation (Rodrigues) and position in frame C. False where the
/// view does not give it.
bool BoardPose(const View& view, const world::Rig& rig, cv::Vec3d* rotation, cv::Vec3d* position);

}  // namespace chase::calibrate
