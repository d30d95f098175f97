#pragma once

#include <opencv2/dnn.hpp>
#include <vector>

#include "services/perception/detector.h"

namespace chase::perception {

/// Boxes from a neural network in an ONNX file. One output of shape 1 x N x (4 + classes); a row is
/// centre x, centre y, width, height in pixels of the network's input, then one score per class.
class NetworkDetector : public Detector {
 public:
  /// Throws std::runtime_error when the file is missing or not a network.
  NetworkDetector(const NetworkConfig& config, const world::Rig& rig);

  /// Empty when the network's output has another shape.
  std::vector<Detection> Detect(const cv::Mat& bgr) const override;

 private:
  Detection Describe(const float* row, const cv::Size& image) const;

  NetworkConfig config_;
  mutable cv::dnn::Net net_;  // forward() is not const though it only fills caches
};

}  // namespace chase::perception
