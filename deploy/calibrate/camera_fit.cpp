#include "deploy/calibrate/camera_fit.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace chase::calibrate {
namespace {

constexpr std::size_t kLeastViews = 5;
constexpr double kLeastTilt = 0.25;  // rad between two views: the focal length needs perspective

struct Solved {
  double rms;
  cv::Mat matrix, deviations;
  std::vector<cv::Mat> rotations;
};

Solved Solve(const std::vector<std::vector<cv::Point3f>>& at,
             const std::vector<std::vector<cv::Point2f>>& px, cv::Size size, int flags) {
  Solved s;
  s.matrix = (cv::Mat_<double>(3, 3) << size.width, 0, 0.5 * (size.width - 1), 0, size.width,
              0.5 * (size.height - 1), 0, 0, 1);
  cv::Mat distortion, shifts, extrinsic_deviations, errors;
  s.rms = cv::calibrateCamera(at, px, size, s.matrix, distortion, s.rotations, shifts, s.deviations,
                              extrinsic_deviations, errors,
                              flags | cv::CALIB_FIX_ASPECT_RATIO | cv::CALIB_USE_INTRINSIC_GUESS |
                                  cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3);
  return s;
}

/// The largest angle between the normals of two views, rad.
double Tilt(const std::vector<cv::Mat>& rotations) {
  double most = 0.0;
  for (const cv::Mat& a : rotations)
    for (const cv::Mat& b : rotations) {
      cv::Mat A, B;
      cv::Rodrigues(a, A);
      cv::Rodrigues(b, B);
      most = std::max(most, std::acos(std::clamp(A.col(2).dot(B.col(2)), -1.0, 1.0)));
    }
  return most;
}

}  // namespace

cv::Mat CameraFit::matrix() const {
  return (cv::Mat_<double>(3, 3) << focal_px, 0, center_u_px, 0, focal_px, center_v_px, 0, 0, 1);
}

CameraFit FitCamera(const std::vector<View>& views, cv::Size size) {
  CameraFit fit;
  std::vector<std::vector<cv::Point3f>> at;
  std::vector<std::vector<cv::Point2f>> px;
  for (const View& view : views)
    if (!view.empty()) at.push_back(view.at), px.push_back(view.px);
  if (at.size() < kLeastViews) {
    fit.problem = "the board is found in " + std::to_string(at.size()) +
                  " pictures; show it in 5 or more, from all sides and near the edges";
    return fit;
  }
  const Solved plain = Solve(at, px, size, cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2);
  if (Tilt(plain.rotations) < kLeastTilt) {
    fit.problem = "all views are parallel, which leaves the focal length open; tilt the board";
    return fit;
  }
  fit.rms_px = plain.rms;
  fit.distorted_rms_px = Solve(at, px, size, 0).rms;
  fit.focal_px = plain.matrix.at<double>(0, 0);
  fit.center_u_px = plain.matrix.at<double>(0, 2);
  fit.center_v_px = plain.matrix.at<double>(1, 2);
  fit.focal_sigma = std::max(plain.deviations.at<double>(0), plain.deviations.at<double>(1));
  fit.center_sigma = std::max(plain.deviations.at<double>(2), plain.deviations.at<double>(3));
  return fit;
}

bool BoardPose(const View& view, const cv::Mat& matrix, cv::Vec3d* rotation, cv::Vec3d* position) {
  return !view.empty() &&
         cv::solvePnP(view.at, view.px, matrix, cv::noArray(), *rotation, *position, false,
                      cv::SOLVEPNP_IPPE) &&
         cv::solvePnP(view.at, view.px, matrix, cv::noArray(), *rotation, *position, true);
}

}  // namespace chase::calibrate
