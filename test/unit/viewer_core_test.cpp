#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "services/viewer/cloud.h"
#include "services/viewer/history.h"
#include "services/viewer/outbox.h"
#include "services/viewer/page_text.h"
#include "services/viewer/play_clock.h"
#include "services/viewer/request.h"
#include "services/viewer/viewer_config.h"

namespace chase::viewer {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Frame FrameOf(int key, size_t bytes) {
  return {key, std::make_shared<const std::string>(bytes, 'x'), false};
}

std::vector<float> Coordinates(std::mt19937* random, size_t n, float reach) {
  std::uniform_real_distribution<float> draw(-reach, reach);
  std::vector<float> out(n);
  for (float& v : out) v = draw(*random);
  return out;
}

TEST(ViewerCloud, KeepsAtMostThatManyAndSpreadsThem) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const size_t n = seed * 500;
    const auto x = Coordinates(&random, n, 20), y = Coordinates(&random, n, 20),
               z = Coordinates(&random, n, 3);
    const auto kept = Thinned(x, y, z, 1000);
    EXPECT_LE(kept.size(), 1000U);
    EXPECT_GE(kept.size(), std::min<size_t>(n, 200));  // an edge too small by sqrt(2) kept too many
    EXPECT_EQ(std::set<size_t>(kept.begin(), kept.end()).size(), kept.size());
  }
}

TEST(ViewerCloud, LeavesOutWhatIsNotFinite) {
  const float nan = std::nanf("");
  const std::vector<float> x = {1, nan, 3, 1e30F}, y = {1, 2, INFINITY, 0}, z = {1, 2, 3, 0};
  EXPECT_EQ(Thinned(x, y, z, 10), std::vector<size_t>{0});
  EXPECT_TRUE(Thinned({}, {}, {}, 10).empty());
  EXPECT_EQ(Thinned(x, y, {1}, 10).size(), 1U);  // sizes that disagree
}

TEST(ViewerCloud, IsEncodedToTheCentimetre) {
  std::mt19937 random(3);
  const auto x = Coordinates(&random, 200, 50), y = Coordinates(&random, 200, 50),
             z = Coordinates(&random, 200, 50);
  const Vector3d origin(10, -5, 2);
  const std::string bytes = EncodeCloud(1.5, 0x010203, origin, x, y, z, 1000);
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 4, 4);
  ASSERT_EQ(count, 200U);
  EXPECT_EQ(bytes.substr(0, 4), "\1\3\2\1") << "a sweep, of that generation";
  ASSERT_EQ(bytes.size(), 40U + 6U * count);
  for (size_t i = 0; i < count; ++i) {
    int16_t xyz[3];
    std::memcpy(xyz, bytes.data() + 40 + 6 * i, 6);
    EXPECT_NEAR(origin.x() + 0.01 * xyz[0], x[i], 0.0051);
    EXPECT_NEAR(origin.z() + 0.01 * xyz[2], z[i], 0.0051);
  }
  const std::string lost = EncodeCloud(0, 0, Vector3d::Constant(kNan), x, y, z, 10);
  EXPECT_EQ(lost.substr(16, 24), std::string(24, '\0'));  // about the world's origin then
}

TEST(ViewerScene, AxesOfACovariance) {
  const Matrix3d R = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Matrix3d S = R * Vector3d(4, 1, 0.25).asDiagonal() * R.transpose();
  const Axes axes = AxesOf(S);
  const Matrix3d again = axes.R.toRotationMatrix() * axes.half.cwiseAbs2().asDiagonal() *
                         axes.R.toRotationMatrix().transpose();
  EXPECT_LT((again - S).norm(), 1e-9);
  EXPECT_EQ(AxesOf(Matrix3d::Constant(kNan)).half, Vector3d::Zero());
  EXPECT_EQ(AxesOf(-Matrix3d::Identity()).half, Vector3d::Zero());
}

TEST(ViewerScene, AnEllipsoidsHalfAxes) {
  world::Obstacle o;
  o.shape = Vector3d(1, 0.25, 4).asDiagonal();
  Vector3d half = SolidOf(o, 0.0).half;
  std::sort(half.data(), half.data() + 3);
  EXPECT_LT((half - Vector3d(0.5, 1, 2)).norm(), 1e-9);
  o.shape.setZero();
  EXPECT_TRUE(SolidOf(o, 0.0).half.isZero());
}

TEST(ViewerScene, TheFanWidens) {
  Forecast f;
  f.covariance = 0.01 * Matrix3d::Identity();
  f.velocity_covariance = 0.04 * Matrix3d::Identity();
  EXPECT_NEAR(SpreadAt(f, 0.0), 0.1, 1e-12);
  // 0.5 m/s^2 that is forgotten within 0.5 s, over four times as long: 2/3 x^3 - x^2 + 2 - 2 (1 +
  // x) exp(-x), times 0.5^2 0.5^4.
  const double manoeuvre = (2.0 / 3.0 * 64 - 16 + 2 - 10 * std::exp(-4)) * 0.015625;
  EXPECT_NEAR(SpreadAt(f, 2.0), std::sqrt(0.01 + 0.16 + manoeuvre), 1e-12);
}

Scene FullScene(double v) {
  Scene scene;
  scene.drone = Drone{Vector3d::Constant(v), Vector3d::Constant(v), {v, v, v, v}, 0, "", 0.0};
  scene.target = Target();
  scene.target->state = 1;
  scene.target->p_WT.setConstant(v);
  scene.target->covariance.setConstant(v);
  scene.plan = Plan();
  scene.plan->path.coefficients.setConstant(v);
  scene.plan->stop = scene.plan->path;
  scene.forecast = Forecast();
  scene.forecast->covariance.setConstant(v);
  scene.forecast->path.duration = v;
  return scene;
}

TEST(ViewerText, TellsTheGeofenceAndTheWorstProcess) {
  Scene scene;
  EXPECT_FALSE(json::parse(StateText(scene, 0.0, 0, {})).contains("fence"));
  EXPECT_EQ(json::parse(StateText(scene, 0.0, 0, {}))["row"][15], -1);
  scene.fence = Fence{{{-1, 2}, {3, 4}, {kNan, 0}}, -0.5, 30.0};
  scene.processes = 3;
  const json state = json::parse(StateText(scene, 0.0, 0, {}));
  EXPECT_EQ(state["fence"]["corners"], json::parse("[[-1, 2], [3, 4], [null, 0]]"));
  EXPECT_EQ(state["fence"]["floor"], -0.5);
  EXPECT_EQ(state["fence"]["ceiling"], 30.0);
  EXPECT_EQ(state["row"][15], 3);
}

TEST(ViewerText, WhatIsNotFiniteIsNull) {
  for (const double v : {kNan, kInfinity, -kInfinity, 1e308}) {
    const json state = json::parse(StateText(FullScene(v), v, 0, PlayState{v, v, v, true}));
    EXPECT_EQ(state["type"], "state");
    EXPECT_EQ(state["drone"]["p"].size(), 3U);
  }
  const json state = json::parse(StateText(FullScene(kNan), 1.0, 0, {}));
  EXPECT_TRUE(state["drone"]["p"][0].is_null());
  EXPECT_TRUE(state["plan"]["path"][0].is_null());
}

TEST(ViewerText, WhereTheFlightIs) {
  Scene scene;
  scene.flight = Flight{4, "hold commanded", 2.0, {"POSE is not heard"}, 0.1};
  json state = json::parse(StateText(scene, 5.0, 0, {}));
  EXPECT_EQ(state["flight"]["state"], 4);
  EXPECT_EQ(state["flight"]["reason"], "hold commanded");
  EXPECT_EQ(state["flight"]["missing"][0], "POSE is not heard");
  EXPECT_EQ(state["row"][14], 4);
  scene.flight->age = 2.1;  // nobody says so any more
  state = json::parse(StateText(scene, 5.0, 0, {}));
  EXPECT_EQ(state["row"][14], -1);
}

TEST(ViewerText, NothingHeardYet) {
  const json state = json::parse(StateText(Scene(), 0.0, 7, {}));
  EXPECT_EQ(state["generation"], 7);
  EXPECT_FALSE(state.contains("drone"));
  EXPECT_FALSE(state.contains("play"));
  EXPECT_TRUE(state["row"][1].is_null());
  EXPECT_EQ(state["row"][5], -1);
  EXPECT_EQ(json::parse(ObstaclesText({}, 0.0, 0.0, 7))["rows"].size(), 0U);
  EXPECT_EQ(json::parse(ObstaclesText({}, 0.0, 0.0, 7))["generation"], 7);
  EXPECT_EQ(json::parse(HealthText({}, ""))["rows"].size(), 0U);
}

TEST(ViewerText, TextsFromElsewhereNeedNotBeUtf8) {
  Scene scene = FullScene(1.0);
  scene.plan->reason = "\xff\xfe\"<script>";
  EXPECT_NO_THROW(json::parse(StateText(scene, 0.0, 0, {})));
  ProcessHealth p;
  p.name = p.detail = "\xc3\x28";
  EXPECT_EQ(json::parse(HealthText({p}, "\xff"))["rows"].size(), 1U);
}

TEST(ViewerText, AStateIsSmall) {  // ten a second on a link of 200 kB/s
  EXPECT_LT(StateText(FullScene(-1234.5678), 1234.5678, 3, PlayState{}).size(), 4500U);
}

TEST(ViewerText, TheImageCarriesTheBox) {
  Target target;
  target.state = 1;
  target.box_px = {10, 20, 30, 40};
  const std::string bytes = EncodeImage(1.0, 376, 240, target, "JPEG");
  uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 4, 4);
  const json about = json::parse(bytes.substr(8, length));
  EXPECT_EQ(about["box"], json({10, 20, 30, 40}));
  EXPECT_EQ(bytes.substr(8 + length), "JPEG");
  target.box_px.setConstant(kNan);
  EXPECT_EQ(EncodeImage(1.0, 376, 240, target, "").find("box"), std::string::npos);
}

TEST(ViewerHistory, IsBounded) {
  History seconds(10.0), whole(1e9);
  for (int i = 0; i < 20000; ++i) {
    seconds.Add(SampleOf(Scene(), 0.1 * i));
    whole.Add(SampleOf(Scene(), 0.1 * i));
  }
  EXPECT_NEAR(static_cast<double>(seconds.samples().size()), 101, 1);
  EXPECT_LE(whole.samples().size(), History::kMost);
  EXPECT_EQ(whole.samples().front().t, 0.0);
  EXPECT_NEAR(whole.samples().back().t, 1999.9, 1e-9);
  Scene flying = FullScene(1.0);
  whole.Add(SampleOf(flying, 2001.0));
  whole.ForgetPositions();
  EXPECT_TRUE(std::isnan(whole.samples().back().p_WB.x()));
  EXPECT_GT(whole.samples().back().speed, 0.0);
  seconds.Add(SampleOf(Scene(), 0.0));  // another flight
  EXPECT_EQ(seconds.samples().size(), 1U);
}

TEST(ViewerOutbox, ASlowPageHearsTheNewest) {
  Outbox outbox({1, 1000000, 0});
  for (size_t i = 1; i <= 1000; ++i) {
    outbox.Push(FrameOf(1, i));
    outbox.Push(FrameOf(2, i));
  }
  EXPECT_EQ(outbox.waiting(), 2000U);
  EXPECT_EQ(outbox.dropped(), 1998);
  EXPECT_EQ(outbox.Next()->bytes->size(), 1000U);
  EXPECT_EQ(outbox.Next()->key, 2);
  EXPECT_FALSE(outbox.Next().has_value());
}

TEST(ViewerOutbox, OldFramesGoAndAnswersStay) {
  Outbox outbox({4, 100, 0});
  outbox.Push(FrameOf(-1, 60));
  for (int i = 0; i < 10; ++i) outbox.Push(FrameOf(i % 2, 10));
  EXPECT_LE(outbox.waiting(), 100U);
  EXPECT_EQ(outbox.Next()->key, -1);
}

TEST(ViewerOutbox, WaitsForAcknowledgements) {
  Outbox outbox({1, 1000000, 100});
  for (int i = 0; i < 4; ++i) outbox.Push(FrameOf(i, 60));
  EXPECT_TRUE(outbox.Next().has_value());
  EXPECT_TRUE(outbox.Next().has_value());  // 60 under way: room
  EXPECT_FALSE(outbox.Next().has_value());
  outbox.Acknowledge(1);
  EXPECT_TRUE(outbox.Next().has_value());
  outbox.Acknowledge(1000000000);
  EXPECT_TRUE(outbox.Next().has_value());
  outbox.Acknowledge(-5);
}

TEST(ViewerPlayClock, StaysInTheLog) {
  PlayClock clock(10.0);
  clock.SetSpeed(1000.0);
  clock.Advance(0.5);
  EXPECT_EQ(clock.t(), 5.0);  // ten times is the fastest
  clock.Advance(100.0);
  EXPECT_EQ(clock.t(), 10.0);
  EXPECT_FALSE(clock.playing());
  clock.Play(true);
  EXPECT_EQ(clock.t(), 0.0);
  clock.Seek(kNan);
  clock.SetSpeed(kNan);
  clock.Seek(-3.0);
  EXPECT_EQ(clock.t(), 0.0);
  clock.Seek(kInfinity);
  EXPECT_EQ(clock.t(), 0.0);
  clock.SetSpeed(0.0);
  clock.Advance(1.0);
  EXPECT_NEAR(clock.t(), 0.1, 1e-12);
}

TEST(ViewerRequest, ReadsWhatAPageAsks) {
  const auto r = ParseRequest(R"({"ack":2,"want":["cloud"],"seek":1.5,"play":false,"speed":2})");
  ASSERT_TRUE(r.has_value());
  EXPECT_EQ(r->acknowledged, 2);
  EXPECT_EQ(r->wants, std::vector<std::string>{"cloud"});
  EXPECT_EQ(r->seek, 1.5);
  EXPECT_EQ(r->play, false);
  EXPECT_EQ(r->speed, 2.0);
}

TEST(ViewerRequest, RefusesGarbage) {
  for (const char* text :
       {"", "{", "[]", "7", "null", R"({"ack":"1"})", R"({"want":"cloud"})", R"({"want":[1]})",
        R"({"seek":null})", R"({"play":1})", R"({"command":{}})", "\xff\xfe"})
    EXPECT_FALSE(ParseRequest(text).has_value()) << text;
  EXPECT_FALSE(ParseRequest(std::string(60000, '[')).has_value());
  EXPECT_FALSE(ParseRequest(R"({"token":")" + std::string(1025, 'x') + "\"}").has_value());
  EXPECT_EQ(ParseRequest(R"({"ack":-9})")->acknowledged, 0);
  EXPECT_EQ(ParseRequest(R"({"ack":18446744073709551615})")->acknowledged >= 0, true);
}

TEST(ViewerRequest, CommandsNeedTheToken) {
  Request r;
  r.command = "land";
  r.token = "secret-token";
  EXPECT_EQ(RefusalOf(r, "secret-token"), "");
  EXPECT_NE(RefusalOf(r, ""), "");
  EXPECT_NE(RefusalOf(r, "secret-tokem"), "");
  EXPECT_NE(RefusalOf(r, "secret-token-longer"), "");
  for (const char* not_from_a_page : {"kill", "select"}) {
    r.command = not_from_a_page;
    EXPECT_NE(RefusalOf(r, "secret-token"), "");
  }
  r.command = "explode";
  EXPECT_NE(RefusalOf(r, "secret-token"), "");
  r.token.clear();
  EXPECT_NE(RefusalOf(r, ""), "");  // no token configured: off, whatever comes
}

TEST(ViewerConfig, NamesWhatIsWrong) {
  EXPECT_EQ(ViewerConfig().Problem(), "");
  ViewerConfig config;
  config.token = "short";
  EXPECT_EQ(config.Problem().find("token"), 0U);
  config = {};
  config.image_rate_hz = kNan;
  EXPECT_EQ(config.Problem().find("image_rate_hz"), 0U);
  config = {};
  config.port = 70000;
  EXPECT_EQ(config.Problem().find("port"), 0U);
}

}  // namespace
}  // namespace chase::viewer
