#include "deploy/calibrate/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace chase::calibrate {
namespace {

constexpr double kMagnified = 20.0;
constexpr int kScale = 2, kAcross = 3;
const cv::Scalar kGreen(60, 200, 60), kRed(60, 60, 230), kInk(40, 40, 40), kGrey(180, 180, 180);
const cv::Size kPanel(1600, 300);  // px, of the turns about an axis
constexpr double kLull = 0.3;      // s without a turn: the board was out of view
constexpr double kDegree = M_PI / 180.0;

cv::Point Pixel(const cv::Point2d& px) {
  return {static_cast<int>(std::lround(kScale * (px.x + 0.5))),
          static_cast<int>(std::lround(kScale * (px.y + 0.5)))};
}

void Draw(const Eigen::Vector3d& p_C, const world::Rig& rig, const cv::Scalar& color,
          cv::Mat* picture) {
  if (p_C.z() < 0.1) return;
  const Eigen::Vector2d px = rig.Project(p_C);
  if (px.cwiseAbs().maxCoeff() < 1e4)
    cv::circle(*picture, Pixel({px.x(), px.y()}), 2, color, cv::FILLED);
}

void Write(const std::string& words, const cv::Point& at, cv::Mat* picture) {
  cv::putText(*picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, kInk, 1, cv::LINE_AA);
}

/// Turns about one axis over time; the panel's height is twice `most`.
class Panel {
 public:
  Panel(const std::vector<ComparedTurn>& turns, double most, cv::Mat picture)
      : from_(turns.front().t), to_(turns.back().t), most_(most), picture_(std::move(picture)) {}

  void DrawGrid(const std::string& axis) {
    cv::line(picture_, At(from_, 0.0), At(to_, 0.0), kGrey);
    for (double t = from_; t <= to_; t += 1.0)
      cv::line(picture_, At(t, 0.0) - cv::Point(0, 6), At(t, 0.0) + cv::Point(0, 6), kGrey);
    cv::rectangle(picture_, {cv::Point(), picture_.size()}, kGrey);
    Write(axis, {10, 20}, &picture_);
  }
  void DrawTurns(const std::vector<ComparedTurn>& turns, int axis) {
    const auto error = [axis](const ComparedTurn& turn) {
      return kMagnified * (turn.camera - turn.gyro)[axis];
    };
    for (std::size_t k = 1; k < turns.size(); ++k) {
      const ComparedTurn &a = turns[k - 1], &b = turns[k];
      if (b.t - a.t > kLull) continue;
      cv::line(picture_, At(a.t, error(a)), At(b.t, error(b)), kRed);
      cv::line(picture_, At(a.t, a.gyro[axis]), At(b.t, b.gyro[axis]), kGreen, 2);
    }
    for (const ComparedTurn& turn : turns)
      cv::circle(picture_, At(turn.t, turn.camera[axis]), 2, kInk, cv::FILLED);
  }

 private:
  cv::Point At(double t, double angle) const {
    return {static_cast<int>(std::lround(picture_.cols * (t - from_) / (to_ - from_))),
            static_cast<int>(std::lround(0.5 * picture_.rows * (1.0 - angle / most_)))};
  }

  double from_, to_, most_;  // s, s, rad
  cv::Mat picture_;
};

}  // namespace

cv::Mat CameraPicture(const std::vector<View>& views, const world::Rig& rig) {
  cv::Mat picture(cv::Size(rig.width_px, rig.height_px) * kScale, CV_8UC3, cv::Scalar::all(255));
  for (const View& view : views) {
    cv::Vec3d rotation, position;
    if (!BoardPose(view, rig, &rotation, &position)) continue;
    cv::Matx33d R;
    cv::Rodrigues(rotation, R);
    for (std::size_t i = 0; i < view.px.size(); ++i) {
      const cv::Vec3d p = R * cv::Vec3d(view.at[i].x, view.at[i].y, view.at[i].z) + position;
      const Eigen::Vector2d model = rig.Project({p[0], p[1], p[2]});
      const cv::Point2d found = view.px[i], error = found - cv::Point2d(model.x(), model.y());
      cv::circle(picture, Pixel(found), 2, kInk, cv::FILLED);
      cv::line(picture, Pixel(found), Pixel(found + kMagnified * error), kRed);
    }
  }
  return picture;
}

cv::Mat LidarPicture(const Sightings& sightings, const LidarFit& fit,
                     const Eigen::Isometry3d& before, const world::Rig& rig) {
  std::vector<cv::Mat> tiles;
  for (std::size_t k = 0; k < sightings.frames.size(); ++k) {
    if (fit.used[k].empty()) continue;
    cv::Mat tile;
    cv::resize(sightings.frames[k], tile, {}, kScale, kScale, cv::INTER_NEAREST);
    for (const Eigen::Vector3d& p_L : fit.used[k]) {
      Draw(before * p_L, rig, kRed, &tile);
      Draw(fit.X_CL * p_L, rig, kGreen, &tile);
    }
    tiles.push_back(tile);
  }
  if (tiles.empty()) return {};
  std::vector<cv::Mat> rows;
  for (std::size_t first = 0; first < tiles.size(); first += kAcross) {
    std::vector<cv::Mat> row(
        tiles.begin() + static_cast<std::ptrdiff_t>(first),
        tiles.begin() + static_cast<std::ptrdiff_t>(std::min(first + kAcross, tiles.size())));
    while (row.size() < kAcross)
      row.emplace_back(tiles[0].size(), tiles[0].type(), cv::Scalar::all(255));
    rows.emplace_back();
    cv::hconcat(row, rows.back());
  }
  cv::Mat picture;
  cv::vconcat(rows, picture);
  return picture;
}

cv::Mat ImuPicture(const ImuFit& fit) {
  if (fit.compared.size() < 2) return {};
  double most = 0.0;
  for (const ComparedTurn& turn : fit.compared)
    most = std::max(most, 1.2 * turn.gyro.cwiseAbs().maxCoeff());
  static const char* const axes[] = {"x (right, pitch)", "y (down, yaw)", "z (forward, roll)"};
  cv::Mat picture(3 * kPanel.height, kPanel.width, CV_8UC3, cv::Scalar::all(255));
  for (int i = 0; i < 3; ++i) {
    Panel panel(fit.compared, most,
                picture(cv::Rect(0, i * kPanel.height, kPanel.width, kPanel.height)));
    panel.DrawGrid(fmt::format("turn about {} of the camera, the height is +- {:.1f} degrees",
                               axes[i], most / kDegree));
    panel.DrawTurns(fit.compared, i);
  }
  Write(fmt::format("dots: camera; green: gyroscope by the fit; red: difference x {:g}; a mark a "
                    "second",
                    kMagnified),
        {10, picture.rows - 12}, &picture);
  return picture;
}

}  // namespace chase::calibrate
