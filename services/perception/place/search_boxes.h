#pragma once

#include <optional>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

/// Where in the image a thing may be seen, given how well it is known.
struct SearchBoxes {
  cv::Rect2d expected;  ///< its own, px
  cv::Rect2d search;    ///< pieces of it may lie here
  cv::Rect2d trim;      ///< all of it lies here
};

/// Nothing where it lies behind the camera. `tilt`: standard deviation of the camera's, rad.
std::optional<SearchBoxes> WhereToLook(const TargetGaussian& thing, const TargetShape& shape,
                                       const Camera& camera, double tilt);

/// The part of a detection that may be the thing: where the detection is larger, a like colour
/// behind goes on outside. Nothing where no part of it lies inside.
std::optional<Detection> Within(const SearchBoxes& boxes, const cv::Mat& bgr,
                                const Detection& detection);

/// 1 for the size that is expected in the middle of where it is expected, less for all else.
double Likeness(const cv::Rect2d& box, const SearchBoxes& boxes);

/// Height in the image [px], counted less towards the sides.
double Prominence(const Detection& detection, const world::Rig& rig);

}  // namespace chase::perception
