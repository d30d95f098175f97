// Flights after a marker: the detector measures the centre itself, with or without LiDAR points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/aruco.hpp>
#include <tuple>

#include "perception_world.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
using perception_test::Fly;
using perception_test::FlyOptions;
using perception_test::Outcome;
using perception_test::World;

constexpr double kSoon = 1.0;                // s, enough to see that it drives
constexpr int kId = 7, kCells = 6;           // the black border's among them
constexpr double kSide = 0.2, kQuiet = 0.1;  // m, edge of the square and the white around it

/// A target that winds `distance` m ahead of a drone that sways.
World WindingAhead(double distance) {
  World w;
  w.target = [distance](double t) {
    return Vector3d(distance + 0.1 * std::sin(0.5 * t), 0.35 * std::sin(0.8 * t), 0.75);
  };
  w.body = [](double t) {
    return perception_test::Body{
        {0.05 * std::sin(0.7 * t), 0.08 * std::cos(0.6 * t), 0.8 + 0.03 * std::sin(t)},
        Eigen::AngleAxisd(0.05 * std::sin(0.9 * t), Vector3d::UnitZ()) *
            Eigen::AngleAxisd(0.03 * std::sin(1.1 * t), Vector3d::UnitY())};
  };
  return w;
}

/// Level of the marker `right` and `down` m from its middle; -1 beside it.
int Level(const cv::Mat& marker, double right, double down) {
  const double reach = std::max(std::abs(right), std::abs(down));
  if (reach > 0.5 * kSide + kQuiet) return -1;
  if (reach >= 0.5 * kSide) return 230;
  const auto cell = [](double at) { return static_cast<int>((at / kSide + 0.5) * kCells); };
  return marker.at<uint8_t>(cell(down), cell(right)) > 0 ? 230 : 20;
}

/// Draws the marker of a target at p_WT, which faces the camera `depth` before the centre.
void DrawMarker(const World& world, double t, const Vector3d& p_WT, double depth, cv::Mat* bgr) {
  constexpr int kSuper = 4;
  cv::Mat marker;
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50), kId, kCells,
                        marker, 1);
  const auto& rig = world.rig;
  const auto body = world.body(t);
  const Eigen::Matrix3d R_WC = body.R.toRotationMatrix() * rig.R_BC();
  const Vector3d p_CT = R_WC.transpose() * (p_WT - body.p - body.R * rig.camera_position);
  const Vector3d n = p_CT.normalized(), center = p_CT - depth * n;
  const Vector3d right = Vector3d::UnitY().cross(n).normalized(), down = n.cross(right);
  const Eigen::Vector2d middle = rig.Project(center);
  const double reach = 1.5 * (0.5 * kSide + kQuiet) / center.z() * rig.focal_px;
  const auto from = [&](double at) { return std::max(0, static_cast<int>(at - reach)); };
  for (int y = from(middle.y()); y < std::min<double>(bgr->rows, middle.y() + reach); ++y)
    for (int x = from(middle.x()); x < std::min<double>(bgr->cols, middle.x() + reach); ++x) {
      Vector3d sum = Vector3d::Zero();
      auto& px = bgr->at<cv::Vec3b>(y, x);
      for (int k = 0; k < kSuper * kSuper; ++k) {
        const double u = x + (k % kSuper + 0.5) / kSuper - 0.5;
        const double v = y + (k / kSuper + 0.5) / kSuper - 0.5;
        const Vector3d ray((u - rig.center_u_px) / rig.focal_px,
                           (v - rig.center_v_px) / rig.focal_px, 1.0);
        const Vector3d off = n.dot(center) / n.dot(ray) * ray - center;
        const int level = Level(marker, right.dot(off), down.dot(off));
        sum += level < 0 ? Vector3d(px[0], px[1], px[2]) : Vector3d::Constant(level);
      }
      for (int i = 0; i < 3; ++i) px[i] = cv::saturate_cast<uint8_t>(sum[i] / (kSuper * kSuper));
    }
}

/// Follows the marker alone; `shift` is how far off the truth it is drawn, frame W, m.
std::vector<Outcome> FlyAfterMarker(const World& world, bool lidar,
                                    const std::function<Vector3d(double)>& shift) {
  PerceptionConfig config;
  config.detector.kind = "marker";
  config.detector.marker.id = kId;
  config.detector.marker.side = kSide;
  FlyOptions options;
  options.duration = 3.0;
  options.lidar = lidar;
  options.spoil_image = [&](double t, cv::Mat* bgr) {
    DrawMarker(world, t, world.target(t) + shift(t), config.detector.marker.depth, bgr);
  };
  return Fly(world, config, options);
}

double SquaredDistance(const Outcome& o) {
  const Vector3d error = o.estimate.p_WT - o.truth;
  return error.dot(o.estimate.covariance.ldlt().solve(error));
}

Vector3d NoShift(double) { return Vector3d::Zero(); }

void ExpectTracked(const Outcome& o) {
  EXPECT_EQ(o.estimate.state, TargetState::kTracking) << o.t << " s";
  EXPECT_LT(SquaredDistance(o), 16.0)
      << o.t << " s, off by " << (o.estimate.p_WT - o.truth).transpose() << " m";
}

using Flight = std::tuple<double, bool>;  // distance, m; LiDAR

class PerceptionMarkerFlight : public testing::TestWithParam<Flight> {};

TEST_P(PerceptionMarkerFlight, IsTrackedSoonAndWithinItsCovariance) {
  const auto [distance, lidar] = GetParam();
  int with_points = 0;
  for (const auto& o : FlyAfterMarker(WindingAhead(distance), lidar, NoShift)) {
    if (o.t < kSoon) continue;
    ExpectTracked(o);
    with_points += o.estimate.n_points > 0;
  }
  EXPECT_EQ(with_points > 10, lidar);
}

INSTANTIATE_TEST_SUITE_P(Ranges, PerceptionMarkerFlight,
                         testing::Combine(testing::Values(1.2, 2.0, 3.0), testing::Bool()));

class PerceptionMarkerStray : public testing::TestWithParam<bool> {};  // LiDAR

TEST_P(PerceptionMarkerStray, MovesNothing) {
  const auto at = [](double t, double when) { return std::abs(t - when) < 0.01; };
  const auto shift = [&](double t) -> Vector3d {
    if (at(t, 1.5)) return {1.0, 0.0, 0.0};  // beyond it
    if (at(t, 2.2)) return {0.0, 1.0, 0.0};  // beside it
    return Vector3d::Zero();
  };
  int strays = 0;
  for (const auto& o : FlyAfterMarker(WindingAhead(2.0), GetParam(), shift)) {
    if (o.t < kSoon) continue;
    ExpectTracked(o);
    if (shift(o.t).norm() == 0.0) continue;
    ++strays;
    EXPECT_TRUE(o.estimate.n_points > 0 || o.estimate.box.width == 0.0) << o.t << " s: taken";
  }
  EXPECT_EQ(strays, 2);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutLidar, PerceptionMarkerStray, testing::Bool());

}  // namespace
}  // namespace chase::perception
