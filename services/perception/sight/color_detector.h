#pragma once

#include <utility>
#include <vector>

#include "services/perception/sight/color_model.h"
#include "services/perception/sight/detector.h"

namespace chase::perception {

/// Blobs of the target's colour, ranked by their shape, and after them pieces of those that
/// may be several things, ranked likewise.
class ColorDetector : public Detector {
 public:
  static constexpr double kLeastArea = 20.0;  ///< px^2; smaller blobs are noise

  ColorDetector(const DetectorConfig& config, double edge_sigma_px)
      : ColorDetector(config.shape, ColorModel(config.color), edge_sigma_px) {}
  ColorDetector(const ShapeConfig& shape, ColorModel color, double edge_sigma_px)
      : shape_(shape), color_(std::move(color)), edge_sigma_px_(edge_sigma_px) {}

  std::vector<Detection> Detect(const cv::Mat& bgr) const override;

 private:
  ShapeConfig shape_;
  ColorModel color_;
  double edge_sigma_px_;
};

}  // namespace chase::perception
