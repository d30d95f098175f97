#include <gtest/gtest.h>

#include <filesystem>

#include "chase/camera_image_t.hpp"
#include "chase/target_t.hpp"
#include "logs/src/key_moments.h"
#include "logs/src/lane.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

Json Span(const char* lane, const char* label, double from, double to) {
  return {{"lane", lane}, {"label", label}, {"from", from}, {"to", to}};
}

std::vector<std::pair<double, std::string>> Shown(const std::vector<Moment>& moments) {
  std::vector<std::pair<double, std::string>> out;
  for (const Moment& m : moments) out.emplace_back(m.t, m.label);
  return out;
}

TEST(KeyMoments, AreThoseOfEventsAndTheMiddleInOrder) {
  const Json spans = {Span("flight", "CHASE", 0, 20),   Span("verdict", "chase", 0, 6),
                      Span("verdict", "brake", 6, 8),   Span("verdict", "wider", 8, 20),
                      Span("target", "tracking", 0, 4), Span("target", "occluded", 4, 5),
                      Span("pose", "ok", 0, 20),        Span("fault", "lidar-gap", 5.8, 5.8)};
  const std::vector<std::pair<double, std::string>> expected = {
      {0.0, "CHASE"},   {4.0, "target occluded"},     {5.8, "lidar-gap"},
      {10.0, "midway"}, {15.0, "smallest clearance"}, {19.0, "at the end"}};
  EXPECT_EQ(Shown(KeyMoments(spans, {{15.0, "smallest clearance", 1}})), expected)
      << "the brake comes within a second of the fault that explains it";
}

TEST(KeyMoments, OfTooManyTheFaultsAndStatesStay) {
  Json spans = Json::array();
  for (int i = 0; i < 40; ++i)
    spans.push_back(Span("verdict", i % 2 ? "brake" : "kept", 2 * i, 2 * i + 2));
  for (int i = 0; i < 5; ++i) spans.push_back(Span("fault", "gust", 15 * i + 0.5, 15 * i + 0.5));
  const auto moments = KeyMoments(spans, {});
  ASSERT_EQ(moments.size(), 12u);
  int gusts = 0;
  for (size_t i = 0; i < moments.size(); ++i) {
    gusts += moments[i].label == "gust";
    if (i > 0) {
      EXPECT_GE(moments[i].t, moments[i - 1].t + 1.0);
    }
  }
  EXPECT_EQ(gusts, 5);
  EXPECT_TRUE(KeyMoments(Json::array(), {}).empty());
}

camera_image_t ImageAt(int64_t utime) {
  camera_image_t m{};
  m.utime = utime;
  m.width = m.height = 8;
  m.row_stride = 24;
  m.size = 192;
  m.data.assign(192, 100);
  return m;
}

TEST(KeyMoments, HaveTheNextImageWithTheBoxFoundInIt) {
  const std::string log = ::testing::TempDir() + "chase_moments.lcm";
  OutputLog out(log);
  constexpr int64_t kOrigin = 7'000'000;
  for (int i = 0; i < 40; ++i) {  // an image each 0.1 s; perception is 40 ms behind, blind at 2.0 s
    const int64_t utime = kOrigin + i * 100'000;
    out.Write(utime, "CAMERA_IMAGE", ImageAt(utime));
    target_t target{};
    target.utime = utime;
    target.state = i == 20 ? target_t::OCCLUDED : target_t::TRACKING;
    target.box_px[0] = i;
    target.box_px[2] = target.box_px[3] = i == 20 ? 0.0 : 2.0;
    out.Write(utime + 40'000, "TARGET", target);
  }
  out.Close();
  const Json found = ImagesAt(log, kOrigin, {{0.0, "a"}, {1.23, "b"}, {2.0, "c"}, {30.0, "late"}});
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0]["t"], 0.0);
  EXPECT_EQ(found[1]["t"], 1.3);
  EXPECT_EQ(found[1]["label"], "b");
  EXPECT_EQ(found[1]["box"][0], 13.0);
  EXPECT_EQ(found[1]["state"], 1);
  EXPECT_FALSE(found[2].contains("box"));
  EXPECT_EQ(found[2]["state"], 2);
  EXPECT_EQ(found[2]["jpeg"].get<std::string>().substr(0, 4), "/9j/");
  std::filesystem::remove(log);
}

TEST(KeyMoments, HaveTheirImagesBehindAClockThatWasSet) {
  const std::string log = ::testing::TempDir() + "chase_moments_set.lcm";
  OutputLog out(log);
  for (int i = 0; i < 40; ++i) {
    camera_image_t image = ImageAt(i * 100'000 + (i < 30 ? 0 : 3'600'000'000));
    image.seq = i;
    out.Write(image.utime, "CAMERA_IMAGE", image);
  }
  out.Close();
  const Json found = ImagesAt(log, 0, {{3.5, "a"}});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0]["t"], 3.5, 0.11);
  std::filesystem::remove(log);
}

TEST(Lane, AStretchHasTheReasonThatItBeganWith) {
  Lane lane;
  lane.Add(0.0, "CHASE");
  lane.Add(0.5, "HOLD", "asked for");
  lane.Add(1.0, "HOLD", "something else");
  auto spans = nlohmann::ordered_json::array();
  lane.AddTo("flight", &spans);
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_FALSE(spans[0].contains("reason"));
  EXPECT_EQ(spans[1]["reason"], "asked for");
}

TEST(Lane, AStretchEndsWhereItsReasonsWordsChange) {
  Lane lane(true);
  double t = 0.0;
  for (const char* reason : {"hold", "hold", "stop", "the battery is low: 24 %",
                             "the battery is low: 9.5 %", "fcu: a pilot flies"})
    lane.Add(t += 0.5, "HOLD", reason);
  auto spans = nlohmann::ordered_json::array();
  lane.AddTo("flight", &spans);
  ASSERT_EQ(spans.size(), 4u);
  EXPECT_EQ(spans[1]["reason"], "stop");
  EXPECT_EQ(spans[1]["from"], 1.5);
  EXPECT_EQ(spans[0]["to"], 1.5);
  EXPECT_EQ(spans[2]["reason"], "the battery is low: 24 %") << "only its number changes";
  EXPECT_NEAR(lane.seconds().at("HOLD"), 2.5, 1e-9);
  EXPECT_EQ(KeyMoments(spans, {}).front().label, "HOLD");
  for (const Moment& m : KeyMoments(spans, {})) EXPECT_TRUE(m.t < 0.6 || m.label != "HOLD") << m.t;
}

TEST(Lane, AMessageStandsForASecondAtMost) {
  Lane lane;
  for (const auto& [t, name] : std::vector<std::pair<double, std::string>>{
           {-1.0, "ok"}, {0.0, "ok"}, {0.5, "lost"}, {5.0, "lost"}, {5.2, "ok"}})
    lane.Add(t, name);
  EXPECT_NEAR(lane.seconds().at("ok"), 1.5, 1e-9);
  EXPECT_NEAR(lane.seconds().at("lost"), 1.2, 1e-9);
  Json spans = Json::array();
  lane.AddTo("pose", &spans);
  const Json expected = {Span("pose", "ok", -1.0, 0.5), Span("pose", "lost", 0.5, 1.5),
                         Span("pose", "lost", 5.0, 5.2), Span("pose", "ok", 5.2, 5.2)};
  EXPECT_EQ(spans, expected);
}

}  // namespace
}  // namespace chase::logs
