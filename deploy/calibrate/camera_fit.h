#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "deploy/calibrate/board.h"

namespace chase::calibrate {

/// A pinhole camera with fx = fy, as the rig has it.
struct CameraFit {
  std::string problem;  ///< why there is none; empty: there is one
  double focal_px = 0.0, center_u_px = 0.0, center_v_px = 0.0;
  double focal_sigma = 0.0, center_sigma = 0.0;  ///< standard deviations, px
  double rms_px = 0.0;                           ///< of the corners, without distortion
  double distorted_rms_px = 0.0;                 ///< with radial terms k1 and k2
  cv::Mat matrix() const;
};

/// Zhang 2000 through OpenCV, on views of the board in pictures of one size: at least 5, tilted
/// against each other.
CameraFit FitCamera(const std::vector<View>& views, cv::Size size);

/// The board seen by a known camera: rotation (Rodrigues) and position in frame C. False where the
/// view does not give it.
bool BoardPose(const View& view, const cv::Mat& matrix, cv::Vec3d* rotation, cv::Vec3d* position);

}  // namespace chase::calibrate
