// An operator names the target by a pixel of the image.

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "chase/command_ack_t.hpp"
#include "chase/target_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "common/world/commands.h"
#include "perception_world.h"
#include "services/perception/perception_node.h"
#include "services/perception/tools/select.h"
#include "test/unit/bad_line.h"

namespace chase::perception {
namespace {

using perception_test::Thing;

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds
const Eigen::Vector3d kBlue = {0.05, 0.25, 0.9};
const Eigen::Vector3d kPost(3.0, 1.0, 0.6);  // an orange one beside the target

class Silent : public bus::Node {};

/// The node before a blue target, which stands 3 m ahead of it, and an orange post of its shape.
class Bench {
 public:
  Bench() : world_(World()), renderer_(world_) {
    lockstep_.Add("command", 0, [this](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<target_t>("TARGET", [this](const target_t& m) { out.push_back(m); });
      bus.Subscribe<command_ack_t>("COMMAND_ACK", [this](const auto& m) { acks.push_back(m); });
      bus.Subscribe<selection_t>("SELECTION", [this](const auto& m) { selections.push_back(m); });
      return std::make_unique<Silent>();
    });
    mission_ = lockstep_.Connect();
    mission_->SetIdentity({"mission", "", kStart});
    lockstep_.Add("perception", 0, [](bus::Bus& bus) {
      return std::make_unique<PerceptionNode>(bus, PerceptionConfig{});
    });
  }

  static perception_test::World World() {
    perception_test::World world = perception_test::StillWorld(3.0);
    world.target_rgb = kBlue;
    world.things.push_back({Thing::Kind::kCylinder, kPost, {0.15, 0.15, 0.25}, {1.0, 0.45, 0.05}});
    return world;
  }

  void Run(double seconds, bool images = true) {
    for (const double end = t_ + seconds; t_ < end - 1e-9; t_ += 0.005, ++step_) {
      lockstep_.RunUntil(Utime());
      if (step_ % 20 == 1 && step_ > 20) SendScan(t_ - 0.1);
      if (images && step_ % 10 == 5) SendImage();
      SendPose();
      lockstep_.RunUntil(Utime());
    }
  }

  /// `id` tells commands apart.
  command_t Command(double u, double v, int64_t id) const {
    command_t m{};
    m.utime = Utime();
    m.id = id;
    m.kind = command_t::SELECT;
    m.n_arguments = 2;
    m.arguments = {u, v};
    return m;
  }
  /// The answer.
  command_ack_t Send(const command_t& command) {
    bus_->Publish("COMMAND", command);
    lockstep_.RunUntil(Utime());
    return acks.back();
  }
  command_ack_t Select(double u, double v, int64_t id) { return Send(Command(u, v, id)); }
  void StartAnew() {
    lockstep_.Kill("perception");
    lockstep_.Start("perception");
  }
  std::string Error() const { return lockstep_.bus("perception").last_error(); }
  void Keep(const selection_t& selection) { mission_->Publish("SELECTION_KEPT", selection); }
  cv::Point2d TargetPixel() { return Middle(renderer_.Image(t_).box); }
  cv::Point2d PostPixel() {  // to the left of the target: y grows to the left
    const cv::Point2d at = TargetPixel();
    const double focal = world::Rig().focal_px;
    return {at.x - focal * kPost.y() / kPost.x(), at.y};
  }
  static cv::Point2d Middle(const cv::Rect2d& box) { return 0.5 * (box.tl() + box.br()); }
  double Off(const Eigen::Vector3d& p) const { return (bus::ToVector(out.back().mean) - p).norm(); }
  Eigen::Vector3d target() const { return world_.target(t_); }
  double t() const { return t_; }
  /// How often the blue one has been chosen after the orange one, or the other way round.
  int Choices() const {
    int choices = 0;
    std::optional<bool> before;
    for (const selection_t& m : selections) {
      const bool blue = m.hue_min > 60.0;
      choices += before != blue;
      before = blue;
    }
    return choices;
  }

  std::vector<target_t> out;
  std::vector<command_ack_t> acks;
  std::vector<selection_t> selections;

 private:
  int64_t Utime() const { return kStart + std::llround(t_ * 1e6); }

  void SendPose() {
    const PoseSample pose = renderer_.Pose(t_);
    pose_t m{};
    m.utime = Utime();
    bus::Set(m.pos, pose.p_WB);
    bus::Set(m.vel, pose.v_WB);
    bus::Set(m.orientation, pose.R_WB);
    bus_->Publish("POSE", m);
  }

  void SendScan(double t) {
    const Sweep sweep = renderer_.Lidar(t);
    lidar_scan_t m{};
    m.utime = kStart + std::llround(t * 1e6);
    for (size_t i = 0; i < sweep.points.size(); ++i) {
      m.x.push_back(sweep.points[i].x());
      m.y.push_back(sweep.points[i].y());
      m.z.push_back(sweep.points[i].z());
      m.t.push_back(sweep.times[i]);
    }
    m.size = static_cast<int32_t>(m.x.size());
    m.intensity.resize(m.x.size());
    m.ring.resize(m.x.size());
    bus_->Publish("LIDAR_SCAN", m);
  }

  void SendImage() {
    const cv::Mat bgr = renderer_.Image(t_).bgr;
    camera_image_t m{};
    m.utime = Utime();
    m.width = bgr.cols;
    m.height = bgr.rows;
    m.row_stride = 3 * bgr.cols;
    m.pixelformat = camera_image_t::PIXEL_FORMAT_BGR;
    m.data.assign(bgr.data, bgr.data + bgr.total() * 3);
    m.size = static_cast<int32_t>(m.data.size());
    bus_->Publish("CAMERA_IMAGE", m);
  }

  perception_test::World world_;
  perception_test::Renderer renderer_;
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  std::unique_ptr<bus::Bus> mission_;
  double t_ = 0.0;
  int step_ = 0;
};

TEST(Select, WhatIsPointedAtIsChasedAtOnceWhateverItsColour) {
  Bench bench;
  bench.Run(0.5);
  EXPECT_EQ(bench.out.back().state, +target_t::SEARCHING);
  const cv::Point2d at = bench.TargetPixel();
  const command_ack_t ack = bench.Select(at.x, at.y, 1);
  EXPECT_EQ(ack.verdict, +command_ack_t::ACCEPTED) << ack.reason;
  EXPECT_EQ(ack.reason.find("selected: "), 0U) << ack.reason;
  bench.Run(0.15);
  ASSERT_EQ(bench.out.back().state, +target_t::TRACKING) << "though it stands";
  EXPECT_LT(bench.Off(bench.target()), 0.1);
  bench.Run(4.0);
  EXPECT_EQ(bench.out.back().state, +target_t::TRACKING);
  EXPECT_LT(bench.Off(bench.target()), 0.1) << "and the orange one is nothing to it";
}

TEST(Select, TheSameCommandAgainIsAnsweredAndNotObeyed) {
  Bench bench;
  bench.Run(0.5);
  const cv::Point2d at = bench.TargetPixel();
  const cv::Point2d post = bench.PostPixel();
  ASSERT_EQ(bench.Select(post.x, post.y, 1).verdict, +command_ack_t::ACCEPTED)
      << bench.acks.back().reason;
  bench.Run(0.15);
  ASSERT_LT(bench.Off(kPost), 0.2);
  const std::string first = bench.acks.back().reason;
  ASSERT_EQ(bench.Select(at.x, at.y, 2).verdict, +command_ack_t::ACCEPTED);
  bench.Run(0.15);
  ASSERT_LT(bench.Off(bench.target()), 0.1);
  const command_ack_t late = bench.Select(post.x, post.y, 1);
  EXPECT_EQ(late.verdict, +command_ack_t::ACCEPTED);
  EXPECT_EQ(late.reason, first);
  bench.Run(0.5);
  EXPECT_LT(bench.Off(bench.target()), 0.1) << "where the second one led";
}

// Late copies of earlier commands keep coming while the next ones are given. Every third points
// beside the image.
TEST(Select, TakesEffectOnceOrIsRefusedOnABadLine) {
  std::mt19937 random(1);
  Bench bench;
  bench.Run(0.5);
  const std::array<cv::Point2d, 2> things = {bench.TargetPixel(), bench.PostPixel()};
  test::BadLine<command_t> there(&random);
  test::BadLine<command_ack_t> back(&random);
  size_t given = 0, frame = 0;
  for (int64_t id = 1; id <= 30; ++id) {
    const bool fits = id % 3 != 0;
    const cv::Point2d at = fits ? things[given % 2] : cv::Point2d(-1.0, 0.0);
    const command_t command = bench.Command(at.x, at.y, id);
    world::CommandClient client(world::kSelectCommand, bench.t());
    while (!client.answered()) {
      ASSERT_FALSE(client.GaveUp(bench.t())) << "command " << id;
      if (client.Due(bench.t())) there.Send(bench.t(), command);
      bench.Run(0.05, frame++ % 5 == 0);
      for (const command_t& c : there.Arrived(bench.t())) back.Send(bench.t(), bench.Send(c));
      for (const command_ack_t& ack : back.Arrived(bench.t()))
        if (ack.id == id) client.OnAnswer(ack.verdict == command_ack_t::ACCEPTED, ack.reason);
    }
    ASSERT_EQ(client.accepted(), fits) << client.reason();
    given += fits;
    ASSERT_EQ(bench.Choices(), static_cast<int>(given)) << "each once, none again";
  }
}

TEST(Select, OutlivesTheProcessWhereMissionKeepsIt) {
  Bench bench;
  bench.Run(0.5);
  EXPECT_TRUE(bench.selections.empty());
  const cv::Point2d at = bench.TargetPixel();
  ASSERT_EQ(bench.Select(at.x, at.y, 1).verdict, +command_ack_t::ACCEPTED);
  bench.Run(2.2);
  ASSERT_EQ(bench.selections.size(), 3U) << "at once, then once a second";
  const selection_t kept = bench.selections.back();
  bench.StartAnew();
  bench.Run(0.5);
  bench.Keep(kept);
  bench.Run(5.0);
  EXPECT_EQ(bench.out.back().state, +target_t::TRACKING);
  EXPECT_LT(bench.Off(bench.target()), 0.1);
  const selection_t& told = bench.selections.back();
  EXPECT_NE(told.sender_start, kept.sender_start) << "for a mission process started anew";
  EXPECT_EQ(std::tie(told.hue_min, told.hue_max, told.saturation_min, told.value_min),
            std::tie(kept.hue_min, kept.hue_max, kept.saturation_min, kept.value_min));
  EXPECT_EQ(std::tie(told.aspect, told.fill, told.inset, told.outline_sigma),
            std::tie(kept.aspect, kept.fill, kept.inset, kept.outline_sigma));
}

TEST(Select, WhatIsKeptYieldsToWhatThisProcessWasTold) {
  Bench bench;
  bench.Run(0.5);
  const cv::Point2d at = bench.TargetPixel();
  ASSERT_EQ(bench.Select(at.x, at.y, 1).verdict, +command_ack_t::ACCEPTED);
  selection_t other = bench.selections.back();
  other.hue_min = 10.0, other.hue_max = 42.0;  // of the orange post
  bench.Keep(other);
  bench.Run(1.0);
  EXPECT_LT(bench.Off(bench.target()), 0.1);
  EXPECT_EQ(bench.selections.back().hue_min, bench.selections.front().hue_min);
}

TEST(Select, WhatIsKeptBeyondItsLimitsIsRefused) {
  Bench bench;
  bench.Run(0.5);
  selection_t kept{};
  kept.hue_max = 42.0;
  kept.aspect = kept.fill = 0.5;
  kept.saturation_min = 1.5;
  bench.Keep(kept);
  bench.Run(0.1);
  EXPECT_TRUE(bench.selections.empty());
  EXPECT_NE(bench.Error().find("saturation_min is 1.5"), std::string::npos) << bench.Error();
}

TEST(Select, IsRefusedWithAReason) {
  Bench bench;
  const auto refused = [&](double u, double v, const std::string& why) {
    static int64_t id = 100;
    const command_ack_t ack = bench.Select(u, v, ++id);
    EXPECT_EQ(ack.verdict, +command_ack_t::REFUSED);
    EXPECT_NE(ack.reason.find(why), std::string::npos) << ack.reason;
  };
  refused(100.0, 100.0, "no image has come yet");
  bench.Run(0.5);
  refused(376.0, 100.0, "(376, 100) is outside the image: columns 0 to 375, rows 0 to 239");
  refused(100.0, -1.0, "is outside the image");
  refused(1e300, 5.0, "is outside the image");
  refused(5.0, 235.0, "");  // the ground
  const cv::Point2d at = bench.TargetPixel();
  bench.Run(0.7, false);
  refused(at.x, at.y, "no image has come for 0.7 s");
  EXPECT_EQ(bench.out.back().state, +target_t::SEARCHING);
}

TEST(LearnAt, SaysWhatStandsAgainstAThing) {
  const DetectorConfig base;
  const auto picture = [] { return cv::Mat(240, 376, CV_8UC3, cv::Scalar(120, 120, 120)); };
  const cv::Scalar blue(230, 70, 20);
  const auto refusal = [&](const cv::Mat& bgr, const cv::Point& at) {
    return LearnAt(bgr, at, base).refusal;
  };
  const auto says = [](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  cv::Mat good = picture();
  cv::rectangle(good, {100, 80, 30, 54}, blue, cv::FILLED);
  const Selection selection = LearnAt(good, {110, 100}, base);
  EXPECT_EQ(selection.refusal, "");
  EXPECT_EQ(selection.box, cv::Rect(100, 80, 30, 54));
  EXPECT_EQ(selection.config.Problem(), "");
  EXPECT_NEAR(selection.config.shape.aspect, 30.0 / 54.0, 0.03);
  cv::Mat cut = picture();
  cv::rectangle(cut, {0, 80, 30, 54}, blue, cv::FILLED);
  says(refusal(cut, {10, 100}), "the image cuts it");
  cv::Mat wide = picture();
  cv::rectangle(wide, {40, 40, 300, 160}, blue, cv::FILLED);
  says(refusal(wide, {100, 100}), "runs on over");
  cv::Mat many = picture();
  for (int x = 20; x < 340; x += 40) cv::rectangle(many, {x, 80, 20, 36}, blue, cv::FILLED);
  says(refusal(many, {30, 90}), "does not set it apart");
}

}  // namespace
}  // namespace chase::perception
