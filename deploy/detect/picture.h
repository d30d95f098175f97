#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "services/perception/perception_config.h"
#include "services/perception/sight/detector.h"

namespace chase::perception {

// The target in single pictures: no pose, no LiDAR, no past.

/// What one picture shows of the target.
struct PictureTarget {
  Detection detection;
  /// From the camera, and its standard deviation [m]; nothing where the size tells none.
  std::optional<double> range, range_sigma;
};

/// Finds the target in pictures (8 bit BGR) of the config's camera, or of it at another resolution.
class PictureDetector {
 public:
  /// Throws std::runtime_error when the detector's file or name is not usable.
  explicit PictureDetector(const PerceptionConfig& config);

  /// Nothing where no detection scores `state.acquire_score`.
  std::optional<PictureTarget> Find(const cv::Mat& bgr);

 private:
  PerceptionConfig config_;
  cv::Size size_;  ///< of the pictures that the detector is for
  std::unique_ptr<Detector> detector_;
};

/// Counts over pictures with masks. One is found where the overlap is at least half.
struct Evaluation {
  static constexpr double kFound = 0.5;  ///< overlap

  int with_target = 0, found = 0, claimed = 0;
  double overlaps = 0.0;  ///< sum over the pictures with a target

  /// `target`: nothing where none was seen. A mask without a pixel says that there is none.
  void Add(const std::optional<PictureTarget>& target, const cv::Mat& mask);
  double precision() const { return claimed > 0 ? static_cast<double>(found) / claimed : 1.0; }
  double recall() const { return with_target > 0 ? static_cast<double>(found) / with_target : 1.0; }
  double mean_overlap() const { return with_target > 0 ? overlaps / with_target : 0.0; }
};

}  // namespace chase::perception
