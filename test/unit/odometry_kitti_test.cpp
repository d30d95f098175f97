#include "test/unit/odometry_kitti.h"

#include <gtest/gtest.h>

#include "services/odometry/odometry.h"

namespace chase::odometry {
namespace {

TEST(OdometryKitti, SixteenRingsStayNearTheSixtyFourRingReference) {
  const std::vector<Sweep> sweeps = test::LoadKittiSweeps({});
  if (sweeps.empty()) GTEST_SKIP() << "skipped: real recordings not present";
  ASSERT_EQ(sweeps.size(), 154u);
  Odometry odometry(OdometryConfig{});
  std::vector<Pose> estimate;
  for (const Sweep& sweep : sweeps) {
    odometry.AddSweep(sweep);
    while (odometry.SweepReady())
      if (const SweepResult result = odometry.ProcessSweep(); result.pose)
        estimate.push_back(result.pose->X_WB);
  }
  ASSERT_EQ(estimate.size(), 154u);
  const std::vector<double> errors =
      test::ErrorsFromFirstPose(estimate, test::LoadKittiReference());
  EXPECT_LT(test::RootMeanSquare(errors), 0.15);
  EXPECT_LT(errors.back(), 0.35);
}

}  // namespace
}  // namespace chase::odometry
