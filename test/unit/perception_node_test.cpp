#include "services/perception/perception_node.h"

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "chase/target_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "common/config/config.h"
#include "perception_world.h"
#include "services/perception/messages.h"

namespace chase::perception {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds
constexpr double kDistance = 3.0;

class Silent : public bus::Node {};

/// The node on an in-memory bus, fed from the synthetic world.
class Bench {
 public:
  Bench() : renderer_(perception_test::StillWorld(kDistance)) {
    lockstep_.Add("test", 0, [this](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<target_t>("TARGET", [this](const target_t& m) { out.push_back(m); });
      return std::make_unique<Silent>();
    });
    lockstep_.Add("perception", 0, [this](bus::Bus& bus) {
      auto node = std::make_unique<PerceptionNode>(bus, perception_test::TakenAtOnce());
      node_ = node.get();
      return node;
    });
  }

  static int64_t At(double t) { return kStart + std::llround(t * 1e6); }

  void SendPose(double t, int8_t health = pose_t::HEALTH_OK) {
    const auto pose = renderer_.Pose(t);
    pose_t m{};
    m.utime = At(t);
    m.health = health;
    bus::Set(m.pos, pose.p_WB);
    bus::Set(m.vel, pose.v_WB);
    bus::Set(m.orientation, pose.R_WB);
    bus_->Publish("POSE", m);
    Settle();
  }

  void SendScan(double t) {
    const auto sweep = renderer_.Lidar(t);
    lidar_scan_t m{};
    m.utime = At(t);
    for (size_t i = 0; i < sweep.points.size(); ++i) {
      m.x.push_back(sweep.points[i].x());
      m.y.push_back(sweep.points[i].y());
      m.z.push_back(sweep.points[i].z());
      m.t.push_back(sweep.times[i]);
    }
    m.x.at(0) = std::nanf("");  // single points may be unusable
    m.size = static_cast<int32_t>(m.x.size());
    m.intensity.resize(m.x.size());
    m.ring.resize(m.x.size());
    bus_->Publish("LIDAR_SCAN", m);
    Settle();
  }

  camera_image_t Image(double t) {
    const cv::Mat bgr = renderer_.Image(t).bgr;
    camera_image_t m{};
    m.utime = At(t);
    m.width = bgr.cols;
    m.height = bgr.rows;
    m.row_stride = 3 * bgr.cols;
    m.pixelformat = camera_image_t::PIXEL_FORMAT_BGR;
    m.data.assign(bgr.data, bgr.data + bgr.total() * 3);
    m.size = static_cast<int32_t>(m.data.size());
    return m;
  }
  void Send(const camera_image_t& m) {
    bus_->Publish("CAMERA_IMAGE", m);
    Settle();
  }

  /// A tenth of a second as it comes: poses, two frames, one sweep.
  void Tenth(int k) {
    for (int i = 0; i < 20; ++i) {
      const double t = 0.1 * k + 0.005 * i;
      if (i == 1 && k > 0) SendScan(0.1 * (k - 1));
      if (i % 10 == 5) Send(Image(t));
      SendPose(t);
    }
  }

  bus::NodeReport Report() const { return node_->Report(); }
  std::vector<target_t> out;

 private:
  void Settle() { lockstep_.RunUntil(lockstep_.now()); }

  perception_test::Renderer renderer_;
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  PerceptionNode* node_ = nullptr;
};

/// What is refused in one picture of an orange block this wide and high, px, without LiDAR.
Refused RefusedOf(int width, int height) {
  const PerceptionConfig config;
  Perceiver perceiver(config);
  for (int i = 0; i <= 20; ++i) {
    PoseSample pose;
    pose.t = 0.005 * i;
    perceiver.AddPose(pose);
  }
  cv::Mat bgr(config.rig.height_px, config.rig.width_px, CV_8UC3, cv::Scalar(120, 120, 120));
  bgr(cv::Rect(150, 80, width, height)).setTo(cv::Scalar(12, 105, 235));
  return perceiver.See({0.1, bgr, {}}).refused;
}

TEST(PerceptionReasons, SayWhyNothingIsAcquired) {
  EXPECT_EQ(RefusedOf(5, 9), (Refused{1, 0, 0, 0}));
  EXPECT_EQ(RefusedOf(120, 20), (Refused{0, 1, 0, 0}));
}

TEST(PerceptionNode, AnswersEveryImageForItsOwnTime) {
  Bench bench;
  for (int k = 0; k < 6; ++k) bench.Tenth(k);
  ASSERT_EQ(bench.out.size(), 12u);
  for (size_t i = 0; i < bench.out.size(); ++i)
    EXPECT_EQ(bench.out[i].utime, Bench::At(0.025 + 0.05 * static_cast<double>(i)));
  EXPECT_EQ(bench.out[0].state, +target_t::SEARCHING);
  const target_t& last = bench.out.back();
  EXPECT_EQ(last.state, +target_t::TRACKING);
  EXPECT_NEAR(last.mean[0], kDistance, 0.05);
  EXPECT_NEAR(last.mean[1], 0.0, 0.03);
  EXPECT_NEAR(last.mean[2], 0.55, 0.03);
  for (const int i : {0, 4, 8}) {
    EXPECT_GT(last.velocity_covariance[i], 1e-4);
    EXPECT_LT(last.velocity_covariance[i], 1.0);
  }
  EXPECT_EQ(last.radius, 0.15);
  EXPECT_EQ(last.height, 0.5);
  EXPECT_NEAR(last.box_px[2], 0.3 * 220.0 / kDistance, 3.0);
  EXPECT_GT(last.score, 0.5);
  EXPECT_EQ(bench.Report().state, bus::NodeReport::State::kOk);
}

TEST(PerceptionNode, StartsWaitingAndSearches) {
  Bench bench;
  EXPECT_EQ(bench.Report().state, bus::NodeReport::State::kStarting);
  bench.Send(bench.Image(0.0));
  ASSERT_EQ(bench.out.size(), 1u);
  EXPECT_EQ(bench.out[0].state, +target_t::SEARCHING);
  EXPECT_EQ(bench.Report().detail, "no pose");
}

TEST(PerceptionMessages, ATargetNotSeenExistsTheLessTheLongerAndSaysWhy) {
  TargetEstimate target;
  double before = 1.0;
  for (const TargetState state :
       {TargetState::kTracking, TargetState::kOccluded, TargetState::kOccluded}) {
    target.state = state;
    target.covariance.setIdentity();
    target.covariance *= std::pow(0.05 + 0.3 * target.unseen, 2);
    const target_t m = ToMessage(target, 0);
    EXPECT_EQ(m.reason.empty(), state == TargetState::kTracking);
    EXPECT_TRUE(target.unseen == 0.0 ? m.existence > 0.999 : m.existence < before);
    EXPECT_GT(m.existence, 0.0);
    before = m.existence;
    target.unseen += 1.0;
  }
  for (const TargetState state : {TargetState::kSearching, TargetState::kLost}) {
    target.state = state;
    EXPECT_EQ(ToMessage(target, 0).existence, 0.0);
    EXPECT_FALSE(ToMessage(target, 0).reason.empty());
  }
}

TEST(PerceptionNode, LostPosesAreNotUsed) {
  Bench bench;
  for (int i = 0; i < 10; ++i) bench.SendPose(0.005 * i, pose_t::HEALTH_LOST);
  bench.Send(bench.Image(0.05));
  EXPECT_EQ(bench.Report().detail, "no pose");
}

TEST(PerceptionNode, ImagesOfOtherKindsAreSaidAndAnswered) {
  Bench bench;
  for (int k = 0; k < 3; ++k) bench.Tenth(k);
  auto m = bench.Image(0.3);
  const auto expect = [&](const camera_image_t& image, const std::string& what) {
    const size_t before = bench.out.size();
    bench.Send(image);
    ASSERT_EQ(bench.out.size(), before + 1) << what;
    EXPECT_NE(bench.Report().detail.find(what), std::string::npos) << bench.Report().detail;
    EXPECT_EQ(bench.Report().state, bus::NodeReport::State::kDegraded);
  };
  auto unknown = m;
  unknown.pixelformat = 42;
  expect(unknown, "pixel format");
  auto deep = m;  // 16 bits a channel
  deep.row_stride *= 2;
  deep.data.resize(deep.data.size() * 2);
  deep.size = static_cast<int32_t>(deep.data.size());
  expect(deep, "8 bit");
  auto narrow = m;
  narrow.row_stride = narrow.width;
  narrow.size = narrow.width * narrow.height;
  narrow.data.resize(static_cast<size_t>(narrow.size));
  expect(narrow, "shorter");
  auto small = m;
  small.height /= 2;
  small.size /= 2;
  small.data.resize(static_cast<size_t>(small.size));
  expect(small, "calibration");
}

TEST(PerceptionNode, RgbAndBgrAreTheSamePicture) {
  Bench bench;
  for (int k = 0; k < 3; ++k) bench.Tenth(k);
  auto m = bench.Image(0.3);
  m.pixelformat = camera_image_t::PIXEL_FORMAT_RGB;
  for (size_t i = 0; i < m.data.size(); i += 3) std::swap(m.data[i], m.data[i + 2]);
  bench.Send(m);
  EXPECT_EQ(bench.out.back().state, +target_t::TRACKING);
  EXPECT_GT(bench.out.back().score, 0.5);
}

/// What loading `yaml` over the defaults says; empty when it is taken.
std::string Refusal(const std::string& yaml) {
  PerceptionConfig config;
  try {
    config::LoadText(yaml, "test", &config);
    return "";
  } catch (const std::runtime_error& e) {
    return e.what();
  }
}

TEST(PerceptionLimits, ARigThatIsNotFiniteIsRefused) {
  for (const std::string bad : {".nan", ".inf", "-.inf"}) {
    for (const std::string field : {"center_u_px", "center_v_px", "camera_pitch_deg", "focal_px"}) {
      const std::string message = Refusal("rig: {" + field + ": " + bad + "}");
      EXPECT_NE(message.find("rig." + field + " is "), std::string::npos) << field << message;
    }
    for (const std::string field : {"lidar_position", "lidar_rpy_deg", "camera_position"}) {
      const std::string message = Refusal("rig: {" + field + ": [0, " + bad + ", 0]}");
      EXPECT_NE(message.find("rig." + field + "[1] is "), std::string::npos) << field << message;
    }
  }
  EXPECT_EQ(Refusal("rig: {center_u_px: 12, lidar_rpy_deg: [180, 0, 90]}"), "");
}

TEST(PerceptionLimits, LookAlikesTakeUpSomeRoom) {
  for (const std::string bad : {"0", "0.04", ".nan"})
    EXPECT_NE(Refusal("state: {decoy_radius: " + bad + "}").find("decoy_radius is "),
              std::string::npos);
  EXPECT_EQ(Refusal("state: {decoy_radius: 0.05}"), "");
}

TEST(PerceptionNode, AFrameNotUsedForItsPoseSaysWhetherOneIsNear) {
  for (const auto& [t, detail] :
       {std::pair(0.04, ""), {0.1, "the pose is too old"}, {0.3, "no pose"}}) {
    Bench bench;
    bench.SendPose(0.0);
    bench.Send(bench.Image(t));
    if (*detail)
      EXPECT_EQ(bench.Report().detail, detail);
    else
      EXPECT_EQ(bench.Report().state, bus::NodeReport::State::kStarting) << "used, none found yet";
  }
}

}  // namespace
}  // namespace chase::perception
