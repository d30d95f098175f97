#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/world/random.h"
#include "common/world/rig.h"
#include "deploy/calibrate/board.h"
#include "deploy/calibrate/lidar_fit.h"

/// A board before a camera and a LiDAR, drawn by OpenCV's model of the lens and by rays.
namespace chase::calibrate::testing {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr double kFocal = 610.0, kU = 322.0, kV = 236.0;
inline const cv::Size kSize(640, 480);

/// The board at this pose, its middle at `middle` in C.
inline Isometry3d BoardAt(const Board& board, const Vector3d& turned, const Vector3d& middle) {
  Isometry3d X = Isometry3d::Identity();
  X.linear() =
      (AngleAxisd(turned.z(), Vector3d::UnitZ()) * AngleAxisd(turned.y(), Vector3d::UnitY()) *
       AngleAxisd(turned.x(), Vector3d::UnitX()))
          .toRotationMatrix();
  X.translation() = middle - X.linear() * Vector3d(0.5 * board.columns * board.square,
                                                   0.5 * board.rows * board.square, 0.0);
  return X;
}

/// k1, k2 of a lens that bends lines by 20 px at the picture's corners.
inline const cv::Vec4d kPinhole(0, 0, 0, 0), kBarrel(-0.22, 0.05, 0, 0);

inline const cv::Mat& Matrix() {
  static const cv::Mat matrix = (cv::Mat_<double>(3, 3) << kFocal, 0, kU, 0, kFocal, kV, 0, 0, 1);
  return matrix;
}

/// The board as a camera sees it: each pixel's ray through OpenCV's model of the lens, and through
/// the homography of the board's plane.
inline cv::Mat Photo(const Board& board, const Isometry3d& X_CP, const cv::Vec4d& lens = kPinhole) {
  std::vector<cv::Point2f> seen, on_board;
  for (const cv::Point3f& corner : board.Outline()) {
    const Vector3d p = X_CP * Vector3d(corner.x, corner.y, 0.0);
    on_board.emplace_back(static_cast<float>(corner.x / board.square * 80.0 - 0.5),
                          static_cast<float>(corner.y / board.square * 80.0 - 0.5));
    seen.emplace_back(static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z()));
  }
  std::vector<cv::Point2f> pixels, rays, map;
  for (int v = 0; v < kSize.height; ++v)
    for (int u = 0; u < kSize.width; ++u)
      pixels.emplace_back(static_cast<float>(u), static_cast<float>(v));
  cv::undistortPoints(pixels, rays, Matrix(), lens, cv::noArray(), cv::noArray(),
                      {cv::TermCriteria::COUNT, 20, 0.0});
  cv::perspectiveTransform(rays, map, cv::getPerspectiveTransform(seen, on_board));
  cv::Mat photo;
  cv::remap(board.Picture(80), photo, cv::Mat(map).reshape(2, kSize.height), cv::noArray(),
            cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(128));
  cv::GaussianBlur(photo, photo, {3, 3}, 0.7);
  cv::cvtColor(photo, photo, cv::COLOR_GRAY2BGR);
  return photo;
}

/// The farthest that a rig puts a point from where that lens shows it, anywhere in the picture, px.
inline double FarthestOff(const world::Rig& rig, const cv::Vec4d& lens) {
  double most = 0.0;
  for (double x = -0.5; x <= 0.5; x += 0.05)
    for (double y = -0.36; y <= 0.36; y += 0.04) {
      std::vector<cv::Point2d> px;
      cv::projectPoints(std::vector<cv::Point3d>{{x, y, 1.0}}, cv::Vec3d(), cv::Vec3d(), Matrix(),
                        lens, px);
      most = std::max(most, (rig.Project({x, y, 1.0}) - Vector2d(px[0].x, px[0].y)).norm());
    }
  return most;
}

/// Rays of a VLP-16 onto the board or onto a wall behind it, with 2 cm of noise.
inline Plane Swept(const Board& board, const Isometry3d& X_CP, const Isometry3d& X_CL,
                   world::Random* random) {
  Plane plane;
  plane.X_CP = X_CP;
  plane.size = {board.columns * board.square, board.rows * board.square};
  const Isometry3d X_LC = X_CL.inverse(), X_LP = X_LC * X_CP;
  const Vector3d n = X_LP.linear().col(2), o = X_LP.translation();
  for (int ring = -15; ring <= 15; ring += 2)
    for (int step = -225; step <= 225; ++step) {  // 90 degrees ahead
      const double e = ring * M_PI / 180.0, a = 0.2 * step * M_PI / 180.0;
      const Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      double range = 5.0 / ray.x();
      const double on_plane = n.dot(o) / n.dot(ray);
      const Vector3d at = X_LP.inverse() * (on_plane * ray);
      if (on_plane > 0.0 && at.x() > 0 && at.x() < plane.size.x() && at.y() > 0 &&
          at.y() < plane.size.y())
        range = on_plane;
      plane.points.push_back((range + 0.02 * random->Gaussian()) * ray);
    }
  return plane;
}

}  // namespace chase::calibrate::testing
