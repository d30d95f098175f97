#include "deploy/calibrate/camera_fit.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

namespace chase::calibrate {
namespace {

constexpr std::size_t kLeastViews = 5;
constexpr double kLeastTilt = 0.25;  // rad between two views: the focal length needs perspective
// The lens's two terms are taken where a likelihood ratio test asks for them: chi-square of two
// degrees of freedom, one in a thousand.
constexpr double kLensGain = 13.8;
// What k2 errs grows with the fifth power of the distance: from here to the corner sixfold.
constexpr double kLeastReach = 0.7;

struct Solved {
  double rms;
  cv::Mat matrix, lens, deviations;
  std::vector<cv::Mat> rotations;
};

Solved Solve(const std::vector<std::vector<cv::Point3f>>& at,
             const std::vector<std::vector<cv::Point2f>>& px, cv::Size size, int flags) {
  Solved s;
  s.matrix = (cv::Mat_<double>(3, 3) << size.width, 0, 0.5 * (size.width - 1), 0, size.width,
              0.5 * (size.height - 1), 0, 0, 1);
  cv::Mat shifts, extrinsic_deviations, errors;
  s.rms = cv::calibrateCamera(at, px, size, s.matrix, s.lens, s.rotations, shifts, s.deviations,
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

/// How far out corners were found, as a share of the way from the centre to the picture's corner.
double Reach(const std::vector<std::vector<cv::Point2f>>& px, const CameraFit& fit, cv::Size size) {
  const cv::Point2d center(fit.center_u_px, fit.center_v_px);
  double farthest = 0.0;
  for (const auto& view : px)
    for (const cv::Point2d corner : view) farthest = std::max(farthest, cv::norm(corner - center));
  return farthest / std::hypot(std::max(center.x, size.width - center.x),
                               std::max(center.y, size.height - center.y));
}

}  // namespace

world::Rig CameraFit::In(world::Rig rig, cv::Size size) const {
  rig.width_px = size.width, rig.height_px = size.height;
  rig.focal_px = focal_px;
  rig.center_u_px = center_u_px, rig.center_v_px = center_v_px;
  rig.lens = k1 == 0.0 && k2 == 0.0 ? "pinhole" : "plumb_bob";
  rig.lens_coefficients << k1, k2, 0.0, 0.0, 0.0;
  return rig;
}

CameraFit FitCamera(const std::vector<View>& views, cv::Size size) {
  CameraFit fit;
  std::vector<std::vector<cv::Point3f>> at;
  std::vector<std::vector<cv::Point2f>> px;
  std::size_t corners = 0;
  for (const View& view : views)
    if (!view.empty()) at.push_back(view.at), px.push_back(view.px), corners += view.px.size();
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
  const Solved behind_lens = Solve(at, px, size, 0);
  const double gain = 4.0 * static_cast<double>(corners) * std::log(plain.rms / behind_lens.rms);
  const Solved& best = gain > kLensGain ? behind_lens : plain;
  fit.pinhole_rms_px = plain.rms;
  fit.rms_px = best.rms;
  fit.focal_px = best.matrix.at<double>(0, 0);
  fit.center_u_px = best.matrix.at<double>(0, 2);
  fit.center_v_px = best.matrix.at<double>(1, 2);
  fit.k1 = best.lens.at<double>(0);
  fit.k2 = best.lens.at<double>(1);
  fit.focal_sigma = std::max(best.deviations.at<double>(0), best.deviations.at<double>(1));
  fit.center_sigma = std::max(best.deviations.at<double>(2), best.deviations.at<double>(3));
  if (&best == &behind_lens && Reach(px, fit, size) < kLeastReach)
    fit.problem = "the lens bends lines, and the board was not shown in the corners; show it there";
  return fit;
}

/// By the corners' rays, which are those of a pinhole with focal length 1.
bool BoardPose(const View& view, const world::Rig& rig, cv::Vec3d* rotation, cv::Vec3d* position) {
  if (view.empty()) return false;
  std::vector<cv::Point2d> rays;
  for (const cv::Point2f& px : view.px) {
    const Eigen::Vector3d ray = rig.Ray({px.x, px.y});
    rays.emplace_back(ray.x(), ray.y());
  }
  const cv::Matx33d pinhole = cv::Matx33d::eye();
  return cv::solvePnP(view.at, rays, pinhole, cv::noArray(), *rotation, *position, false,
                      cv::SOLVEPNP_IPPE) &&
         cv::solvePnP(view.at, rays, pinhole, cv::noArray(), *rotation, *position, true);
}

}  // namespace chase::calibrate
