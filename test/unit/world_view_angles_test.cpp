#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/world/view_angles.h"

namespace chase::world {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

/// Least distance from the image's edges, px, of what planning takes to be in view: between planes
/// through the body's y axis, and beside the axis of a camera that looks straight ahead.
double Inside(const Rig& rig) {
  const ViewAngles view = ViewOf(rig);
  const double pitch = rig.camera_pitch_deg * kDegree;
  double least = HUGE_VAL;
  for (int i = 0; i <= 20; ++i)
    for (int j = 0; j <= 20; ++j) {
      const double down = kDegree * (-view.up + (view.down + view.up) * i / 20.0);
      const double side = std::tan(view.bearing * kDegree) * (j / 10.0 - 1.0);
      const Vector3d p_B(std::cos(down), side * std::cos(down - pitch), -std::sin(down));
      const Vector3d p_C = rig.R_BC().transpose() * p_B;
      const Eigen::Vector2d px = rig.Project(p_C);
      least =
          std::min({least, px.x(), rig.width_px - 1 - px.x(), px.y(), rig.height_px - 1 - px.y()});
    }
  return least;
}

TEST(ViewAngles, WhatIsInViewIsInTheImageHoweverAskewTheCamera) {
  for (const double roll : {-12.0, -6.0, 0.0, 3.0, 9.0})
    for (const double yaw : {-10.0, -5.0, 0.0, 4.0, 8.0})
      for (const double pitch : {0.0, 12.0}) {
        Rig rig;
        rig.camera_roll_deg = roll, rig.camera_yaw_deg = yaw, rig.camera_pitch_deg = pitch;
        Rig straight;
        straight.camera_pitch_deg = pitch;
        EXPECT_GE(Inside(rig), Inside(straight) - 1e-9)
            << "roll " << roll << ", yaw " << yaw << ", pitch " << pitch;
      }
}

TEST(ViewAngles, AStraightCameraSeesItsImageLessThreeDegrees) {
  const ViewAngles view = ViewOf(Rig{});
  EXPECT_NEAR(view.down, 37.51, 0.01);
  EXPECT_NEAR(view.up, 13.51, 0.01);
  EXPECT_NEAR(view.bearing, 37.44, 0.01);
  EXPECT_GT(Inside(Rig{}), 10.0);
}

}  // namespace
}  // namespace chase::world
