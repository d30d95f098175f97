#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "services/perception/perception_config.h"

namespace chase::perception {

/// Sides of a silhouette. Image: u to the right, v down; the centre of the first pixel is (0, 0).
enum Side { kLeft = 0, kRight = 1, kTop = 2, kBottom = 3 };

/// Where the outline was seen, sample by sample.
struct Silhouette {
  std::array<std::vector<Eigen::Vector2d>, 4> samples;  ///< by Side, (u, v) px
  double sigma_px = 0.5;                                ///< standard deviation of one edge
  double departure_px = 0.0;  ///< the part of it that goes with the detection's width
};

/// One thing in the image that may be the target.
struct Detection {
  cv::Rect2d box;                       ///< px, edges between pixels
  double score = 0.0;                   ///< 0 to 1
  double solidity = 0.0;                ///< score of a part of the target, by colour and convexity
  std::array<bool, 4> cut = {};         ///< by Side: it goes on where the image, or the piece, ends
  std::array<bool, 4> goes_on = {};     ///< by Side: a like colour does so, all along the side
  std::array<bool, 4> parted = {};      ///< by Side: likewise, and the blob's outline jumps there
  Silhouette silhouette;                ///< sides that are cut hold no samples
  cv::Rect mask_box;                    ///< where `mask` lies in the image
  cv::Mat mask;                         ///< 8 bit, 255 on the target; may be empty
  double inset_px = 0.0;                ///< border of the mask that does not count, px
  bool part = false;                    ///< a piece of a blob that may well be one thing itself
  std::optional<Eigen::Vector3d> p_CT;  ///< centre, frame C, m, if the detector knows it
  Eigen::Matrix3d p_CT_covariance = Eigen::Matrix3d::Identity();  ///< frame C, m^2

  bool AnyCut() const { return cut[kLeft] || cut[kRight] || cut[kTop] || cut[kBottom]; }
  /// True when it is more than a target that shows in `expected` [px].
  bool LargerThan(const cv::Rect2d& expected) const;
  /// True when the image's border cuts it.
  bool LeavesImage() const {
    for (size_t side = 0; side < 4; ++side)
      if (cut[side] && !goes_on[side]) return true;
    return false;
  }
};

/// Finds things in one image that may be the target, best first.
class Detector {
 public:
  virtual ~Detector() = default;
  /// `bgr`: 8 bit, 3 channels, not empty.
  virtual std::vector<Detection> Detect(const cv::Mat& bgr) const = 0;
};

/// The detector that the config asks for. Throws std::runtime_error when a file or name in it is
/// not usable.
std::unique_ptr<Detector> MakeDetector(const DetectorConfig& config, double edge_sigma_px,
                                       const world::Rig& rig);

}  // namespace chase::perception
