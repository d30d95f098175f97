#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "services/perception/sight/detector.h"

namespace chase::perception {

inline constexpr int kMaxSamples = 8;  ///< of a side
inline constexpr int kLeastPiece = 5;  ///< px, width of a piece

/// The middle one, of an even number the higher; 0 of none.
double Median(std::vector<double> values);

/// First and last set pixel of a row or column, or (-1, -1).
std::pair<int, int> Extent(const cv::Mat& line);

/// Outline of a blob: `mask` (8 bit, 255 on the blob) lies at `roi` in `bgr`. Each edge is placed
/// between pixels from how the colour goes over from the blob to what lies beside it. Sides in
/// `cut` get no samples.
Silhouette TraceSilhouette(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi,
                           const std::array<bool, 4>& cut);

/// How wide the edges of a blob are in the image: from the inside's colour to the outside's at the
/// steepest slope between them, px, the median over its rows; 1 or more. Optics, focus and motion
/// blur it, and so does a picture that was enlarged.
double EdgeWidth(const cv::Mat& bgr, const cv::Mat& mask, const cv::Rect& roi);

/// The mask of a detection less the border that does not count: 8 bit, 255 on the target, lies
/// where the mask does.
cv::Mat Region(const Detection& detection);

/// Edges of a block of pixels where the first pixel's centre is (0, 0).
cv::Rect2d EdgeBox(const cv::Rect& roi);

/// Which sides of `roi` lie at the border of an image of this size.
std::array<bool, 4> CutSides(const cv::Rect& roi, const cv::Size& image);

/// The part of a detection inside `window`, px; samples at which it goes on are left out, and sides
/// without any are cut. The detection must carry a mask; nothing when no part of it lies inside.
std::optional<Detection> CropTo(const cv::Mat& bgr, const Detection& detection,
                                const cv::Rect& window);

/// Pieces of a blob that several things of one colour make up together, split where an end of its
/// columns or of its rows jumps; none where none does.
std::vector<Detection> Split(const cv::Mat& bgr, const Detection& detection);

}  // namespace chase::perception
