#pragma once

#include <opencv2/dnn.hpp>
#include <vector>

#include "services/perception/sight/detector.h"

namespace chase::perception {

/// Boxes from a neural network in an ONNX file. One output of shape 1 x N x (4 + classes); a row is
/// centre x, centre y, width, height in pixels of the network's input, then one score per class.
class NetworkDetector : public Detector {
 public:
  /// Throws std::runtime_error when the file is missing or not a network, or when the network does
  /// not take an image of the configured size or gives another shape, or scores above 1.
  NetworkDetector(const NetworkConfig& config, const world::Rig& rig);

  /// Rows that hold a number that is not finite are left out.
  std::vector<Detection> Detect(const cv::Mat& bgr) const override;

 private:
  cv::Mat Forward(const cv::Mat& bgr) const;
  bool Usable(const float* row) const;
  Detection Describe(const float* row, const cv::Size& image) const;

  NetworkConfig config_;
  mutable cv::dnn::Net net_;  // forward() is not const though it only fills caches
};

}  // namespace chase::perception
