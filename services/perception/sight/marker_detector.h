#pragma once

#include <opencv2/aruco.hpp>
#include <vector>

#include "services/perception/sight/detector.h"

namespace chase::perception {

/// ArUco and AprilTag markers on the target.
class MarkerDetector : public Detector {
 public:
  /// Throws std::runtime_error when the dictionary's name is unknown or it lacks the id.
  MarkerDetector(const MarkerConfig& config, const world::Rig& rig);

  std::vector<Detection> Detect(const cv::Mat& bgr) const override;

 private:
  Detection Describe(const std::vector<cv::Point2f>& corners) const;

  MarkerConfig config_;
  world::Rig rig_;
  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
};

}  // namespace chase::perception
