// Inertial samples that come later than their sweeps, or not at all.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "services/odometry/odometry.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry {
namespace {

/// Odometry, and a body in the hall that stands for 1.5 s and then goes along y at `speed`.
class Stream {
 public:
  explicit Stream(double speed = 0.0) : speed_(speed) {
    for (int i = 0; i <= 300; ++i) {
      Sample(0.005 * i);
      if (i > 0 && i % 20 == 0) Sweep(0.005 * i);
    }
  }

  void Sample(double t, double accel = 0.0) {
    Publish(odometry.AddImu({t, {accel, 0.0, 9.81}, Eigen::Vector3d::Zero()}));
    Process();
  }
  /// That ends at `end`.
  void Sweep(double end) {
    const auto X_WL = [this](double t) {
      const double y = speed_ * std::max(0.0, t - kBegins);
      return Pose{Eigen::Quaterniond::Identity(), {0.0, y, 0.3}};
    };
    odometry.AddSweep(test::Scan(test::Hall{}, X_WL, end - 0.1, test::SensorModel{}, &noise_));
    Process();
  }

  static constexpr double kBegins = 1.5;
  Odometry odometry{OdometryConfig{}};
  std::vector<PoseEstimate> poses;
  int processed = 0;

 private:
  void Publish(const std::optional<PoseEstimate>& pose) {
    if (pose) poses.push_back(*pose);
  }
  void Process() {
    for (; odometry.SweepReady(); ++processed) Publish(odometry.ProcessSweep().pose);
  }

  double speed_;
  test::Noise noise_{1};
};

TEST(OdometryLate, TheMapGrowsWhileTheSpikeFilterRefusesEverySample) {
  Stream stream(1.0);
  const size_t before = stream.odometry.map_cells();
  for (int i = 1; i <= 400; ++i) {
    stream.Sample(Stream::kBegins + 0.005 * i, 200.0);
    if (i % 20 == 0) stream.Sweep(Stream::kBegins + 0.005 * i);
  }
  EXPECT_GT(stream.odometry.map_cells(), before + before / 10);
  EXPECT_NEAR(stream.poses.back().X_WB.p.y(), 2.0, 0.1);
}

// From in time to 0.9 s late, in 6 s.
TEST(OdometryLate, SweepsAreNotProcessedOverAndOverForSamplesThatComeEverLater) {
  Stream stream;
  int next = 1, sweeps = 0;
  const int before = stream.processed;
  for (int i = 1; i <= 1600; ++i) {
    const double now = 0.005 * i;
    for (const double late = std::min(0.9, 0.15 * now); 0.005 * next <= now - late; ++next)
      stream.Sample(Stream::kBegins + 0.005 * next);
    if (i % 20 != 0) continue;
    stream.Sweep(Stream::kBegins + now);
    ++sweeps;
  }
  EXPECT_GE(stream.processed - before, sweeps - 10);
  EXPECT_LE(stream.processed - before, sweeps + 10);
}

// Three sweeps without samples, a few samples, and none again.
TEST(OdometryLate, PosesRiseWhereSweepsAreProcessedAgainWithoutTheirSamples) {
  for (const int samples : {1, 3, 9, 30}) {
    Stream stream;
    for (int i = 1; i <= 3; ++i) stream.Sweep(Stream::kBegins + 0.1 * i);
    for (int i = 1; i <= samples; ++i) stream.Sample(Stream::kBegins + 0.005 * i);
    for (int i = 4; i <= 12; ++i) stream.Sweep(Stream::kBegins + 0.1 * i);
    for (size_t i = 1; i < stream.poses.size(); ++i)
      EXPECT_GT(stream.poses[i].t, stream.poses[i - 1].t) << samples;
    EXPECT_NEAR(stream.poses.back().t, Stream::kBegins + 1.2, 0.11) << samples;
  }
}

}  // namespace
}  // namespace chase::odometry
