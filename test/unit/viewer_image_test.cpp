// The target is drawn into its own image alone.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/bus/log_writer.h"
#include "services/viewer/log_player.h"
#include "services/viewer/page_feed.h"
#include "test/unit/viewer_memory_bus.h"

namespace chase::viewer {
namespace {

using nlohmann::json;

/// Keeps what is told about the images, in their order.
struct ImageSink : PageSink {
  void Send(Part part, std::string bytes, bool) override {
    if (part != Part::kImage) return;
    uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 4, 4);
    told.push_back(json::parse(bytes.substr(8, length)));
  }
  void Retain(Part, std::string) override {}
  bool Wanted(Part part) const override { return part == Part::kImage; }
  std::vector<json> told;
};

camera_image_t ImageAt(int64_t utime) {
  camera_image_t m{};
  m.utime = utime;
  m.width = m.height = 8;
  m.row_stride = 3 * m.width;
  m.pixelformat = camera_image_t::PIXEL_FORMAT_BGR;
  m.size = m.row_stride * m.height;
  m.data.resize(static_cast<size_t>(m.size));
  return m;
}

/// Its box's centre u counts milliseconds.
target_t TargetAt(int64_t utime) {
  target_t m{};
  m.utime = utime;
  m.state = target_t::TRACKING;
  m.box_px[0] = static_cast<double>(utime % kSecond) * 1e-3;
  m.box_px[2] = m.box_px[3] = 2.0;
  return m;
}

class ViewerImage : public ::testing::Test {
 protected:
  /// Later by so many milliseconds.
  void Wait(int64_t ms) { bus_.now += 1000 * ms; }

  MemoryBus bus_;
  ImageSink sink_;
  PageFeed feed_{bus_, sink_, ViewerConfig(), ""};
};

TEST_F(ViewerImage, WaitsForItsTarget) {
  const int64_t utime = bus_.now;
  feed_.Take(TargetAt(utime - 50000));
  feed_.Take(ImageAt(utime));
  EXPECT_TRUE(sink_.told.empty());
  feed_.Take(TargetAt(utime));
  ASSERT_EQ(sink_.told.size(), 1U);
  EXPECT_EQ(sink_.told[0]["box"][0], 0.0);
  EXPECT_EQ(sink_.told[0]["state"], 1);
}

TEST_F(ViewerImage, IsShownWithoutATargetThatIsNotItsOwn) {
  feed_.Take(TargetAt(bus_.now - 50000));
  feed_.Take(ImageAt(bus_.now));
  feed_.Take(TargetAt(bus_.now + 50000));  // its own was lost
  ASSERT_EQ(sink_.told.size(), 1U);
  EXPECT_FALSE(sink_.told[0].contains("box"));
  EXPECT_FALSE(sink_.told[0].contains("state"));
}

TEST_F(ViewerImage, DoesNotWaitForPerceptionThatIsSilent) {
  feed_.Take(TargetAt(bus_.now));
  feed_.Take(ImageAt(bus_.now + 1));
  Wait(400);
  feed_.Tick(bus_.now, "");
  EXPECT_TRUE(sink_.told.empty());
  Wait(200);
  feed_.Tick(bus_.now, "");
  EXPECT_EQ(sink_.told.size(), 1U) << "after the age limit of TARGET";
  for (int i = 0; i < 20; ++i, Wait(50)) feed_.Take(ImageAt(bus_.now));
  EXPECT_EQ(sink_.told.size(), 4U) << "four a second, one after the other";
  for (const json& about : sink_.told) EXPECT_FALSE(about.contains("box")) << about;
}

TEST_F(ViewerImage, WaitsForItsTargetThoughTheLogsClockWasSet) {
  const int64_t utime = bus_.now - 50 * kSecond;  // what is played goes on by the clock before
  feed_.Take(ImageAt(utime));
  Wait(30);
  feed_.Tick(bus_.now, "");
  EXPECT_TRUE(sink_.told.empty());
}

/// Images each 50 ms, their targets 30 ms later, for two seconds; then images alone.
TEST_F(ViewerImage, ASeekShowsABoxThatBelongsToItsImage) {
  const auto file =
      std::filesystem::temp_directory_path() / ("viewer_image_" + std::to_string(::getpid()));
  const std::shared_ptr<void> litter(nullptr, [&](void*) { std::filesystem::remove(file); });
  bus::LogWriter log(file);
  const auto write = [&log](int64_t ms) {
    const int64_t utime = kSecond + 1000 * ms;
    if (ms % 50 == 0) log.Write(utime, "CAMERA_IMAGE", BytesOf(ImageAt(utime)));
    if (ms % 50 == 30 && ms < 2000) log.Write(utime, "TARGET", BytesOf(TargetAt(utime - 30000)));
  };
  for (int64_t ms = 0; ms < 4000; ms += 10) write(ms);
  log.Close();
  LogPlayer player(file);
  PageFeed feed(player, sink_, ViewerConfig(), "log");
  const auto hear = [&feed](const auto& m) { feed.Take(m); };
  player.Subscribe<camera_image_t>("CAMERA_IMAGE", hear);
  player.Subscribe<target_t>("TARGET", hear);
  feed.SetPlay({});
  const auto seek = [&](int64_t ms) {
    feed.Forget();
    player.Seek(kSecond + 1000 * ms);
    feed.Tick(kSecond + 1000 * ms, "");
    return sink_.told.back();
  };
  seek(0);
  for (int64_t ms = 30; ms < 2000; ms += 7) {
    const json about = seek(ms);
    ASSERT_TRUE(about.contains("box")) << ms;
    const double t = about["t"];
    EXPECT_NEAR(about["box"][0], std::fmod(1000.0 * t, 1000.0), 1e-6) << ms;
    EXPECT_LT(1e-3 * static_cast<double>(ms) - t, 0.08) << ms;
  }
  EXPECT_FALSE(seek(3500).contains("box")) << "TARGET is silent";
  EXPECT_EQ(sink_.told.back()["t"], 3.5);
}

}  // namespace
}  // namespace chase::viewer
