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

/// Six sweeps from a start in full drive, as a recording begins that is cut anywhere: they tell the
/// way, though the first one is not deskewed.
TEST(OdometryKitti, SixSweepsFromAnyStartTellTheirWay) {
  const std::vector<Sweep> sweeps = test::LoadKittiSweeps({});
  if (sweeps.empty()) GTEST_SKIP() << "skipped: real recordings not present";
  const std::vector<Pose> reference = test::LoadKittiReference();
  for (size_t start = 0; start + 6 <= sweeps.size(); start += 4) {
    Odometry odometry(OdometryConfig{});
    std::vector<Pose> estimate;
    for (size_t i = start; i < start + 6; ++i) {
      odometry.AddSweep(sweeps[i]);
      while (odometry.SweepReady())
        if (const SweepResult result = odometry.ProcessSweep(); result.pose)
          estimate.push_back(result.pose->X_WB);
    }
    ASSERT_EQ(estimate.size(), 6u) << start;
    const auto way = [](const Pose& a, const Pose& b) { return (b.p - a.p).norm(); };
    EXPECT_GE(way(estimate[0], estimate[5]), 0.92 * way(reference[start], reference[start + 5]))
        << "from sweep " << start;
  }
}

}  // namespace
}  // namespace chase::odometry
