// Lenses against OpenCV's own, and what a rolling shutter does to the target's place.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "services/perception/place/hypotheses.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;

world::Rig WideRig(const std::string& lens, const std::vector<double>& k) {
  world::Rig rig;
  rig.width_px = 1280;
  rig.height_px = 800;
  rig.focal_px = 500.0;
  rig.center_u_px = 630.0;
  rig.center_v_px = 405.0;
  rig.lens = lens;
  for (size_t i = 0; i < k.size(); ++i) rig.lens_coefficients[static_cast<int>(i)] = k[i];
  return rig;
}

Eigen::Vector2d ByOpenCv(const world::Rig& rig, const Vector3d& p, std::vector<double> k) {
  const cv::Matx33d K(rig.focal_px, 0, rig.center_u_px, 0, rig.focal_px, rig.center_v_px, 0, 0, 1);
  const std::vector<cv::Point3d> points = {{p.x(), p.y(), p.z()}};
  std::vector<cv::Point2d> px;
  const cv::Vec3d none(0, 0, 0);
  if (rig.lens == "fisheye")
    cv::fisheye::projectPoints(points, px, none, none, K, k);
  else
    cv::projectPoints(points, none, none, K, k, px);
  return {px[0].x, px[0].y};
}

TEST(PerceptionLens, BendsAsOpenCvSaysAndBack) {
  const std::vector<std::pair<std::string, std::vector<double>>> lenses = {
      {"plumb_bob", {-0.28, 0.09, 1e-3, -5e-4, -0.01}}, {"fisheye", {0.03, -0.01, 0.004, -0.001}}};
  for (const auto& [lens, k] : lenses) {
    const world::Rig rig = WideRig(lens, k);
    ASSERT_EQ(rig.LensProblem(), "");
    for (double x = -0.9; x < 1.0; x += 0.3)
      for (double y = -0.6; y < 0.7; y += 0.3) {
        const Vector3d p(2.0 * x, 2.0 * y, 2.0);
        const Eigen::Vector2d px = rig.Project(p);
        EXPECT_LT((px - ByOpenCv(rig, p, k)).norm(), 1e-6) << lens << x << " " << y;
        EXPECT_LT((rig.Ray(px) - Vector3d(x, y, 1.0)).norm(), 1e-6) << lens << x << " " << y;
      }
  }
}

/// The target's four sides in an image that is read out while the camera flies and turns.
TEST(PerceptionLens, ARollingShutterMovesNothing) {
  world::Rig rig;
  rig.readout = 0.03;
  PoseSample pose;
  pose.p_WB = {0.0, 0.0, 1.0};
  pose.v_WB = {0.0, 5.0, 0.0};
  pose.w_WB_B = {0.0, 0.0, 1.0};
  const Camera camera = CameraAt(pose, rig);
  const Vector3d target(2.0, 0.2, 0.0);  // low in the image: read out late
  const TargetShape shape;
  Detection d;
  const auto add = [&](Side side, const Vector3d& p) {  // where the row is read as it shows p
    Eigen::Vector2d px = *camera.Project(p);
    for (int i = 0; i < 20; ++i) px = *camera.AtRow(px.y()).Project(p);
    d.silhouette.samples[side].push_back(px);
  };
  const Vector3d sight = (target - camera.p_WC).cwiseProduct(Vector3d(1, 1, 0));
  const double tangent = std::asin(shape.size[0] / sight.norm());
  for (const double z : {-0.1, 0.0, 0.1})
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::AngleAxisd turn(sign * tangent, Vector3d::UnitZ());
      const Vector3d touch = turn * sight * std::cos(tangent);
      add(sign > 0.0 ? kLeft : kRight,
          Vector3d(camera.p_WC.x() + touch.x(), camera.p_WC.y() + touch.y(), target.z() + z));
    }
  const Vector3d rim = shape.size[0] * sight.normalized();
  add(kTop, target + rim + Vector3d(0, 0, 0.5 * shape.size[1]));
  add(kBottom, target - rim - Vector3d(0, 0, 0.5 * shape.size[1]));
  FitInput input;
  input.camera = camera;
  input.detection = &d;
  input.prior.mean << target + Vector3d(0.1, -0.1, 0.05), Vector3d::Zero();
  const auto fit = FitTarget(input, {});
  ASSERT_TRUE(fit.ok);
  EXPECT_LT((fit.posterior.position() - target).norm(), 0.02);
  input.camera.rig.readout = 0.0;
  EXPECT_GT((FitTarget(input, {}).posterior.position() - target).norm(), 0.03)
      << "else this shows nothing";
}

/// A camera that looks along x, and lines of sight far off its axis.
const std::vector<Vector3d> kSights = {
    {1, 0, 0}, {1, 0.8, 0}, {1, -0.9, 0.3}, {1, 0.2, -0.5}, {1, -0.7, -0.4}};

Camera LookingAlongX(const world::Rig& rig) {
  Camera camera;
  camera.rig = rig;
  camera.R_WC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return camera;
}

TEST(PerceptionRange, BySizeHoldsFarOffTheAxisAndBehindAnyLens) {
  for (const auto& rig : {WideRig("pinhole", {}), WideRig("plumb_bob", {-0.1, 0.01}),
                          WideRig("fisheye", {0.03, -0.01, 0.004, -0.001})})
    for (const Vector3d& sight : kSights)
      for (const double range : {1.5, 4.0, 9.0}) {
        const Camera camera = LookingAlongX(rig);
        const auto box = ProjectTarget(camera, range * sight.normalized(), {});
        ASSERT_TRUE(box);
        EXPECT_NEAR(RangeBySize(camera, *box, {}), range, 0.02 * range)
            << rig.lens << " " << sight.transpose();
      }
}

TEST(PerceptionRange, OfANewTargetIsAsSureAsWhatToldIt) {
  const Camera camera = LookingAlongX(WideRig("pinhole", {}));
  for (const Vector3d& sight : kSights) {
    const cv::Rect2d box = *ProjectTarget(camera, 4.0 * sight.normalized(), {});
    const TargetGaussian g = NewTarget(camera, box, {}, 4.0, 0.3);
    EXPECT_NEAR(RangeSigma(g, camera), 0.3, 1e-9);
    EXPECT_NEAR(g.position().norm(), 4.0, 1e-9);
  }
}

}  // namespace
}  // namespace chase::perception
