#pragma once

#include <vector>

#include "services/perception/sight/detector.h"

namespace chase::perception {

/// Pieces of a blob on either side of an upright edge inside it, where one thing stands before
/// another of its colour in other light. Such a side has samples like an outline; beyond the rows
/// of its edges a piece is cut.
std::vector<Detection> SplitAtEdges(const cv::Mat& bgr, const Detection& detection);

}  // namespace chase::perception
