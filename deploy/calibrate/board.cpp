#include "deploy/calibrate/board.h"

#include <opencv2/aruco/charuco.hpp>

namespace chase::calibrate {
namespace {

cv::Ptr<cv::aruco::CharucoBoard> Made(const Board& board) {
  return cv::aruco::CharucoBoard::create(
      board.columns, board.rows, static_cast<float>(board.square), static_cast<float>(board.marker),
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
}

}  // namespace

std::string Board::Problem() const {
  if (columns < 3 || rows < 3 || columns > 14 || rows > 14)
    return "a board of " + std::to_string(columns) + " x " + std::to_string(rows) +
           " squares: 3 to 14 each way";
  if (!(square > 0.0 && marker > 0.0 && marker < square))
    return "--square " + std::to_string(square) + " and --marker " + std::to_string(marker) +
           ": both above 0 m, the marker the smaller";
  return "";
}

cv::Point3f Board::Corner(int id) const {
  const int column = id % (columns - 1), row = id / (columns - 1);
  return {static_cast<float>((column + 1) * square), static_cast<float>((row + 1) * square), 0.0f};
}

std::vector<cv::Point3f> Board::Outline() const {
  const auto x = static_cast<float>(columns * square), y = static_cast<float>(rows * square);
  return {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}};
}

cv::Mat Board::Picture(int px_per_square) const {
  cv::Mat picture;
  Made(*this)->draw({columns * px_per_square, rows * px_per_square}, picture);
  return picture;
}

View FindBoard(const cv::Mat& bgr, const Board& board) {
  const auto made = Made(board);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(bgr, made->dictionary, markers, marker_ids);
  View view;
  if (marker_ids.empty()) return view;
  cv::aruco::interpolateCornersCharuco(markers, marker_ids, bgr, made, view.px, view.ids);
  for (const int id : view.ids) view.at.push_back(board.Corner(id));
  return view;
}

}  // namespace chase::calibrate
