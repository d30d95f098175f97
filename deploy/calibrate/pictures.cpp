#include "deploy/calibrate/pictures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace chase::calibrate {
namespace {

constexpr double kMagnified = 20.0;
constexpr int kScale = 2, kAcross = 3;
const cv::Scalar kGreen(60, 200, 60), kRed(60, 60, 230), kInk(40, 40, 40);

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

}  // namespace chase::calibrate
