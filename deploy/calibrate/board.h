#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace chase::calibrate {

/// A ChArUco board: a chessboard with a marker in every white square (OpenCV's dictionary
/// DICT_5X5_100). Its frame: origin at the corner of the outline, x along the columns, y along the
/// rows, in the plane of the board.
struct Board {
  int columns = 7, rows = 5;
  double square = 0.10, marker = 0.075;  ///< edges as printed, m

  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
  /// Inner corners.
  int corners() const { return (columns - 1) * (rows - 1); }
  /// The corner `id` in the board's frame, m.
  cv::Point3f Corner(int id) const;
  /// The four corners of the outline, m.
  std::vector<cv::Point3f> Outline() const;
  /// To be printed: `px_per_square` pixels an edge, without a margin.
  cv::Mat Picture(int px_per_square) const;
};

/// What one picture shows of the board.
struct View {
  std::vector<int> ids;                          ///< of inner corners
  std::vector<cv::Point2f> px;                   ///< where they are
  std::vector<cv::Point3f> at;                   ///< where they are on the board, m
  bool empty() const { return ids.size() < 6; }  ///< too few for a pose
};

View FindBoard(const cv::Mat& bgr, const Board& board);

}  // namespace chase::calibrate
