#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "services/perception/sight/detector.h"
#include "services/perception/tools/learn_color.h"

namespace chase::perception {

/// What is learned from, and how well the learned detector marks it.
struct Learned {
  DetectorConfig config;
  double acquire_score = 0.0;          ///< that parts the target from all else in the pictures
  double overlap = 0.0;                ///< mean of intersection over union with the masks
  std::vector<std::string> shapeless;  ///< pairs that do not tell the shape, and why
  LearnedColor color;                  ///< how well it separates, and which pictures it is from
};

/// Colour, shape and how far inside the colour's outline the marked target lies, from pictures
/// (8 bit BGR) with masks (8 bit, not 0 on the target) of the same sizes. The rest comes from
/// `base`. The shape is that of the blobs that the masks touch and the image does not cut. Throws
/// std::invalid_argument when sizes differ, a mask is empty or is a picture, or none shows the
/// shape.
Learned LearnDetector(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                      const DetectorConfig& base);

/// Of several detections of one picture the target's: the best whole, or a piece that scores more,
/// is not cut anywhere and is no piece of a good whole. Null where there is none.
const Detection* MostLikely(const std::vector<Detection>& found);

/// Intersection over union of a detection's region with a mask of the whole picture (8 bit, not 0
/// on the target); of its box where it has no region.
double Overlap(const Detection& detection, const cv::Mat& mask);

/// Intersection over union of the detector's best region with a mask; 0 where nothing is found.
double Overlap(const DetectorConfig& config, const cv::Mat& bgr, const cv::Mat& mask);

/// `chase-perception --learn-colour IMAGE MASK [IMAGE MASK ...] [--config BASE] --out YAML`: writes
/// a config with the learned detector. Exit code 0, or 1 after one line on stderr.
int LearnColour(int argc, char** argv);

}  // namespace chase::perception
