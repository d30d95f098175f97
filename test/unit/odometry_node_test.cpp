#include "services/odometry/odometry_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "chase/pose_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

class Silent : public bus::Node {};

/// The node on an in-memory bus, with a hand on both ends.
class Bench {
 public:
  Bench() {
    lockstep_.Add("test", 0, [this](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<pose_t>("POSE", [this](const pose_t& m) { poses.push_back(m); });
      bus.Subscribe<scan_registered_t>("SCAN_REGISTERED",
                                       [this](const scan_registered_t& m) { sweeps.push_back(m); });
      return std::make_unique<Silent>();
    });
    lockstep_.Add("odometry", 0, [](bus::Bus& bus) {
      return std::make_unique<OdometryNode>(bus, OdometryConfig{});
    });
  }

  void SendImu(int64_t utime, double forward = 0.0) {
    imu_t m{};
    m.utime = utime;
    bus::Set(m.accel, Eigen::Vector3d(forward, 0.0, 9.81));
    bus_->Publish("IMU", m);
    lockstep_.RunUntil(std::max(utime, lockstep_.now()));
  }

  void SendScan(int64_t utime, int64_t now, const std::function<double(double)>& x = {}) {
    const auto X_WL = [&](double t) {
      return Pose{Eigen::Quaterniond::Identity(), {x ? x(t) : 0.0, 0, 0.3}};
    };
    const Sweep sweep = test::Scan(test::Hall{}, X_WL, 0.0, test::SensorModel{}, &noise_);
    lidar_scan_t m{};
    m.utime = utime;
    m.size = static_cast<int32_t>(sweep.points.size());
    for (const auto& point : sweep.points) {
      m.x.push_back(point.p.x()), m.y.push_back(point.p.y()), m.z.push_back(point.p.z());
      m.t.push_back(point.t);
      m.intensity.push_back(point.intensity), m.ring.push_back(point.ring);
    }
    bus_->Publish("LIDAR_SCAN", m);
    lockstep_.RunUntil(std::max(now, lockstep_.now()));
  }

  std::vector<pose_t> poses;
  std::vector<scan_registered_t> sweeps;

 private:
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  test::Noise noise_{1};
};

TEST(OdometryNode, PoseAtEverySampleAndOneRegisteredSweepPerScan) {
  Bench bench;
  for (int i = 0; i <= 300; ++i) {
    const int64_t now = kStart + 5000 * i;
    bench.SendImu(now);
    if (i > 0 && i % 20 == 0) bench.SendScan(now - 100000, now);
  }
  ASSERT_EQ(bench.poses.size(), 301u);
  EXPECT_EQ(bench.poses.front().health, int{pose_t::HEALTH_STARTING});
  EXPECT_EQ(bench.poses.back().health, int{pose_t::HEALTH_OK}) << bench.poses.back().reason;
  EXPECT_EQ(bench.poses.back().utime, kStart + 5000 * 300);
  for (size_t i = 1; i < bench.poses.size(); ++i)
    EXPECT_EQ(bench.poses[i].utime - bench.poses[i - 1].utime, 5000);
  ASSERT_GE(bench.sweeps.size(), 9u);
  const scan_registered_t& sweep = bench.sweeps.back();
  EXPECT_EQ(sweep.health, int{pose_t::HEALTH_OK});
  EXPECT_GT(sweep.size, 20000);
  EXPECT_NEAR(static_cast<double>(sweep.utime - kStart), 1.5e6, 1000.0);
  EXPECT_NEAR(sweep.pos[2], 0.1, 0.02);  // the rig's lidar above a body at the origin
}

TEST(OdometryNode, WithoutImuOnePosePerScan) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.SendScan(kStart + 100000 * i, kStart + 100000 * (i + 1));
  EXPECT_EQ(bench.poses.size(), 5u);
  EXPECT_EQ(bench.sweeps.size(), 5u);
}

/// Standing for 1.5 s, sweeps handed over when they end; one more of the clock before `first`.
void Stand(int64_t first, bool late_sweep, Bench* bench) {
  for (int i = 0; i <= 300; ++i) {
    const int64_t now = first + 5000 * i;
    bench->SendImu(now);
    if (late_sweep && i == 10) bench->SendScan(kStart + 1'450'000, now);
    if (i > 20 && i % 20 == 0) bench->SendScan(now - 100000, now);
  }
}

TEST(OdometryNode, BeginsAnewWithTheSecondSampleOfAClockThatIsSetBack) {
  Bench bench;
  Stand(kStart, false, &bench);
  const size_t before = bench.poses.size();
  const int32_t epoch = bench.poses.back().epoch;
  const int64_t back = kStart - 60'000'000;
  Stand(back, true, &bench);
  ASSERT_EQ(bench.poses.size(), before + 300);
  EXPECT_EQ(bench.poses[before].utime, back + 5000);
  EXPECT_NE(bench.poses[before].epoch, epoch);
  EXPECT_EQ(bench.poses.back().health, int{pose_t::HEALTH_OK}) << bench.poses.back().reason;
  EXPECT_EQ(bench.poses.back().epoch, bench.poses[before].epoch);
}

TEST(OdometryNode, BeginsAnewAfterASilenceOfAllSensorsWhicheverSpeaksFirst) {
  for (const bool sweep_first : {false, true}) {
    Bench bench;
    Stand(kStart, false, &bench);
    const size_t before = bench.poses.size();
    const int32_t epoch = bench.poses.back().epoch;
    const int64_t after = kStart + 3'500'000;
    if (sweep_first) bench.SendScan(after - 100000, after - 1);
    Stand(after, false, &bench);
    ASSERT_GT(bench.poses.size(), before + 200);
    EXPECT_NE(bench.poses.back().epoch, epoch) << sweep_first;
    EXPECT_EQ(bench.poses.back().health, int{pose_t::HEALTH_OK}) << bench.poses.back().reason;
  }
}

/// To and fro, as smoothly as one that settles.
TEST(OdometryNode, OneThatFlewWhenItsSensorsFellSilentIsNotWaitedFor) {
  constexpr double kRate = 2.0, kAmplitude = 0.12;  // rad/s, m
  Bench bench;
  Stand(kStart, false, &bench);
  const auto fly = [&](int64_t first, int ticks) {
    for (int i = 1; i <= ticks; ++i) {
      const int64_t now = first + 5000 * i;
      const double t = 1e-6 * static_cast<double>(now - kStart - 1'500'000);
      const double begun = t - 0.1;
      bench.SendImu(now, kAmplitude * kRate * kRate * std::cos(kRate * t));
      if (i % 20 == 0)
        bench.SendScan(now - 100'000, now, [&](double since) {
          return kAmplitude * (1.0 - std::cos(kRate * (begun + since)));
        });
    }
  };
  fly(kStart + 1'500'000, 400);
  ASSERT_EQ(bench.poses.back().health, int{pose_t::HEALTH_OK}) << bench.poses.back().reason;
  const int64_t after = kStart + 4'500'000;
  fly(after, 130);
  EXPECT_NE(bench.poses.back().epoch, bench.poses.front().epoch);
  EXPECT_NE(bench.poses.back().health, int{pose_t::HEALTH_STARTING}) << bench.poses.back().reason;
}

TEST(OdometryNode, GoesOnThroughASilenceOfTheImuAlone) {
  Bench bench;
  Stand(kStart, false, &bench);
  const int32_t epoch = bench.poses.back().epoch;
  const int64_t silent = kStart + 1'500'000;
  for (int i = 1; i <= 10; ++i) bench.SendScan(silent + 100000 * (i - 1), silent + 100000 * i);
  Stand(silent + 1'000'000, false, &bench);
  EXPECT_EQ(bench.poses.back().epoch, epoch);
}

/// Standing; from 1.5 s on samples come 0.3 s late for a while, sweeps do not; then what is new
/// overtakes what is late.
TEST(OdometryNode, GoesOnWithSamplesThatWereLateAndAreOvertaken) {
  constexpr int64_t kDelay = 300'000;
  Bench bench;
  Stand(kStart, false, &bench);
  const int64_t late = kStart + 1'500'000, end = late + 1'000'000;
  for (int64_t now = late + 5000; now <= end + 500'000; now += 5000) {
    const bool scan = (now - late) % 100'000 == 0;
    if (now > end) bench.SendImu(now);
    if (now > late + kDelay && now <= end + kDelay) bench.SendImu(now - kDelay);
    if (scan) bench.SendScan(now - 100'000, now);
  }
  for (size_t i = 1; i < bench.poses.size(); ++i) {
    EXPECT_GT(bench.poses[i].utime, bench.poses[i - 1].utime) << "a state that was told already";
    EXPECT_EQ(bench.poses[i].epoch, bench.poses[0].epoch) << "sweeps told how the body went on";
  }
  EXPECT_EQ(bench.poses.back().health, int{pose_t::HEALTH_OK}) << bench.poses.back().reason;
}

/// Thrown to and fro while samples come 0.3 s late: what sweeps alone made of it is not built upon.
TEST(OdometryNode, DoesSweepsAnewOnceTheirSamplesCome) {
  constexpr double kRate = 12.0, kAmplitude = 0.1;  // rad/s, m: 1.2 m/s, 14 m/s^2
  constexpr int64_t kDelay = 300'000, kMoves = kStart + 1'500'000;
  Bench bench;
  Stand(kStart, false, &bench);
  const size_t before = bench.poses.size();
  const auto since = [&](int64_t utime) { return 1e-6 * static_cast<double>(utime - kMoves); };
  const auto x = [&](double t) { return t < 0.0 ? 0.0 : kAmplitude * (1.0 - std::cos(kRate * t)); };
  const auto send = [&](int64_t utime) {
    bench.SendImu(utime, kAmplitude * kRate * kRate * std::cos(kRate * since(utime)));
  };
  for (int64_t now = kMoves + 5000; now <= kMoves + 1'000'000; now += 5000) {
    if (now > kMoves + kDelay) send(now - kDelay);
    const double begun = since(now - 100'000);
    if ((now - kMoves) % 100'000 == 0)
      bench.SendScan(now - 100'000, now, [&](double t) { return x(begun + t); });
  }
  ASSERT_GT(bench.poses.size(), before + 50);
  for (size_t i = before; i < bench.poses.size(); ++i) {
    const pose_t& pose = bench.poses[i];
    EXPECT_GT(pose.utime, bench.poses[i - 1].utime);
    if (pose.utime <= kMoves + kDelay) continue;  // by sweeps alone
    const double t = since(pose.utime);
    EXPECT_NEAR(pose.pos[0], x(t), 0.03) << t;
    EXPECT_NEAR(pose.vel[0], kAmplitude * kRate * std::sin(kRate * t), 0.1) << t;
  }
  for (size_t i = 1; i < bench.sweeps.size(); ++i)
    EXPECT_GT(bench.sweeps[i].utime, bench.sweeps[i - 1].utime);
}

TEST(OdometryNode, BeginsAnewWithoutImuAsWell) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.SendScan(kStart + 100000 * i, kStart + 100000 * (i + 1));
  for (int i = 0; i < 5; ++i) bench.SendScan(kStart - 9'000'000 + 100000 * i, kStart);
  ASSERT_EQ(bench.poses.size(), 9u);
  EXPECT_NE(bench.poses.back().epoch, bench.poses.front().epoch);
}

}  // namespace
}  // namespace chase::odometry
