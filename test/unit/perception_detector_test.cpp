#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "perception_world.h"
#include "services/perception/sensors/image_check.h"
#include "services/perception/sight/color_detector.h"
#include "services/perception/sight/marker_detector.h"
#include "services/perception/sight/silhouette.h"
#include "services/perception/tools/learn_color.h"

namespace chase::perception {
namespace {

using perception_test::GymWorld;
using perception_test::Renderer;
using perception_test::StillWorld;

cv::Mat Grey(int level = 120) { return {240, 376, CV_8UC3, cv::Scalar(level, level, level)}; }

const cv::Scalar kOrangeBgr(12, 105, 235);

TEST(PerceptionColor, ScoresOrangeAndNotItsNeighbours) {
  const ColorConfig config;
  EXPECT_GT(Score(config, ToHsv(0.05, 0.45, 1.0)), 0.99);
  EXPECT_GT(Score(config, ToHsv(0.02, 0.18, 0.4)), 0.99) << "in shade";
  EXPECT_LT(Score(config, ToHsv(0.5, 0.5, 0.5)), 0.01) << "grey";
  EXPECT_LT(Score(config, ToHsv(0.05, 0.05, 0.9)), 0.5) << "red";
  EXPECT_LT(Score(config, ToHsv(0.1, 0.9, 0.9)), 0.5) << "yellow";
  EXPECT_LT(Score(config, ToHsv(0.21, 0.28, 0.36)), 0.5) << "bark";
}

TEST(PerceptionColor, RangeOfHueMayWrap) {
  ColorConfig config;
  config.hue_min_deg = 350;
  config.hue_max_deg = 10;
  EXPECT_GT(Score(config, ToHsv(0.05, 0.0, 1.0)), 0.99);
  EXPECT_GT(Score(config, ToHsv(0.0, 0.05, 1.0)), 0.99);
  EXPECT_LT(Score(config, ToHsv(0.05, 0.45, 1.0)), 0.01);
}

TEST(PerceptionColor, AFullCircleLetsEveryHuePass) {
  ColorConfig config;
  config.hue_min_deg = 0;
  config.hue_max_deg = 360;
  ASSERT_EQ(config.Problem(), "");
  EXPECT_GT(Score(config, ToHsv(0.0, 0.0, 1.0)), 0.99) << "red";
  EXPECT_GT(Score(config, ToHsv(0.0, 1.0, 0.5)), 0.99) << "green";
  EXPECT_GT(Score(config, ToHsv(1.0, 1.0, 0.0)), 0.99) << "cyan";
  EXPECT_GT(Score(config, ToHsv(1.0, 0.0, 0.5)), 0.99) << "violet";
}

TEST(PerceptionColor, AnyHueIsLearnedAsANarrowRange) {
  // From red over yellow, green, cyan, blue and violet, each 20 degrees wide.
  for (int middle = 0; middle < 360; middle += 15) {
    cv::Mat hsv(1, 201, CV_32FC3), bgr;
    for (int i = 0; i <= 200; ++i)
      hsv.at<cv::Vec3f>(0, i) = {
          std::fmod(static_cast<float>(middle) + 350.0f + 0.1f * static_cast<float>(i), 360.0f),
          0.9f, 0.9f};
    cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
    bgr.convertTo(bgr, CV_8U, 255.0);
    const cv::Mat mask(bgr.size(), CV_8U, cv::Scalar(255));
    const ColorConfig learned = LearnColor({bgr}, {mask}, {}).config;
    ASSERT_EQ(learned.Problem(), "");
    const double width = std::fmod(learned.hue_max_deg - learned.hue_min_deg + 360.0, 360.0);
    EXPECT_NEAR(width, 0.94 * 20.0 + 6.0, 1.5) << middle << ", and other light";
    EXPECT_NEAR(std::remainder(learned.hue_min_deg + 0.5 * width - middle, 360.0), 0.0, 1.0);
  }
}

TEST(PerceptionColor, GainsUndoWarmLight) {
  cv::Mat warm = Grey();
  warm.setTo(cv::Scalar(90, 115, 135));
  const Eigen::Vector3d gains = ColorModel{ColorConfig{}}.Gains(warm);
  EXPECT_NEAR(gains[0] * 90, gains[2] * 135, 1.0);
}

TEST(PerceptionColor, FindsTheTargetUnderTintedLight) {
  for (const auto& light : {Eigen::Vector3d(1.08, 0.92, 0.7), Eigen::Vector3d(0.85, 0.95, 1.05),
                            Eigen::Vector3d(0.4, 0.4, 0.4)}) {
    auto world = StillWorld(3.0);
    world.light = light;
    const auto shot = Renderer(world).Image(0.0);
    const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(shot.bgr);
    ASSERT_EQ(found.size(), 1u) << light.transpose();
    EXPECT_GT(found[0].score, 0.7);
    EXPECT_GT((found[0].box & shot.box).area() / (found[0].box | shot.box).area(), 0.85);
  }
}

TEST(PerceptionColor, FindsTheTargetInDimLight) {
  for (const double light : {0.1, 0.15, 0.2, 0.3})
    for (uint32_t seed = 1; seed <= 10; ++seed) {
      auto world = StillWorld(3.0);
      world.light = Eigen::Vector3d::Constant(light);
      world.image_noise = 3.0;
      world.seed = seed;
      const auto shot = Renderer(world).Image(0.0);
      const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(shot.bgr);
      ASSERT_FALSE(found.empty()) << "light " << light << ", seed " << seed;
      const double overlap = (found[0].box & shot.box).area() / (found[0].box | shot.box).area();
      EXPECT_GT(overlap, 0.7) << "light " << light << ", seed " << seed;
      EXPECT_GT(found[0].score, StateConfig{}.acquire_score)
          << "light " << light << ", seed " << seed;
    }
}

TEST(PerceptionColor, WhatIsDarkForItsLightIsNotTheTarget) {
  const cv::Rect place(150, 80, 40, 70);
  for (const double light : {1.0, 0.5, 0.25}) {
    cv::Mat image = Grey() * light;
    image(place).setTo(0.05 * light * kOrangeBgr);
    EXPECT_LT(cv::mean(ColorModel{ColorConfig{}}.Score(image)(place))[0], 127.0) << light;
    image(place).setTo(0.4 * light * kOrangeBgr);
    EXPECT_GT(cv::mean(ColorModel{ColorConfig{}}.Score(image)(place))[0], 250.0) << light;
  }
}

TEST(PerceptionColor, ALampOnTheTargetInTheDarkKeepsItsColour) {
  cv::Mat image = Grey(15);
  const cv::Rect place(150, 80, 40, 70);
  image(place).setTo(kOrangeBgr);
  EXPECT_GT(cv::mean(ColorModel{ColorConfig{}}.Score(image)(place))[0], 250.0);
}

TEST(PerceptionSilhouette, EdgesLieBetweenPixels) {
  for (const double shift : {0.0, 0.25, 0.5, 0.75}) {
    // A bright block from u = 100.5 + shift to 140.5 + shift, drawn by area.
    cv::Mat image = Grey(60);
    cv::rectangle(image, {101, 80}, {140, 150}, kOrangeBgr, cv::FILLED);
    const auto mix = [&](int x, double share) {
      const cv::Scalar c = kOrangeBgr * share + cv::Scalar::all(60) * (1.0 - share);
      cv::line(image, {x, 80}, {x, 150}, c);
    };
    mix(101, 1.0 - shift);
    mix(141, shift);
    const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
    ASSERT_EQ(found.size(), 1u);
    for (const auto& s : found[0].silhouette.samples[kLeft]) EXPECT_NEAR(s.x(), 100.5 + shift, 0.1);
    for (const auto& s : found[0].silhouette.samples[kRight])
      EXPECT_NEAR(s.x(), 140.5 + shift, 0.1);
    for (const auto& s : found[0].silhouette.samples[kTop]) EXPECT_NEAR(s.y(), 79.5, 0.1);
  }
}

TEST(PerceptionSilhouette, AnotherShadeBehindTheEdgeDoesNotMoveIt) {
  cv::Mat image = Grey(10);
  cv::rectangle(image, {100, 151}, {140, 152}, cv::Scalar::all(35), cv::FILLED);
  cv::rectangle(image, {100, 80}, {140, 150}, kOrangeBgr, cv::FILLED);
  const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
  ASSERT_EQ(found.size(), 1u);
  for (const auto& s : found[0].silhouette.samples[kBottom]) EXPECT_NEAR(s.y(), 150.5, 0.05);
}

TEST(PerceptionColor, TwoThingsJoinedByThreadsAreParted) {
  cv::Mat image = Grey();  // the lower one before the other, its side leaning
  for (int y = 86; y < 140; ++y) cv::line(image, {124 + (y - 86) / 18, y}, {155, y}, kOrangeBgr);
  cv::rectangle(image, {158, 80}, {176, 112}, kOrangeBgr, cv::FILLED);
  cv::rectangle(image, {155, 87}, {159, 92}, kOrangeBgr, cv::FILLED);
  const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
  EXPECT_TRUE(std::any_of(found.begin(), found.end(), [](const Detection& d) {
    return std::abs(d.box.x - 157.0) < 3.0 && std::abs(d.box.width - 19.0) < 4.0;
  }));
}

TEST(PerceptionColor, WhatShowsAboveTheTargetIsPartedFromIt) {
  cv::Mat image = Grey();  // a ball behind the upper end of a cylinder
  cv::circle(image, {166, 116}, 18, kOrangeBgr, cv::FILLED);
  cv::rectangle(image, {144, 130}, {186, 205}, kOrangeBgr, cv::FILLED);
  const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
  const auto piece = std::find_if(found.begin(), found.end(), [](const Detection& d) {
    return std::abs(d.box.y - 130.0) < 4.0 && d.box.height > 70.0 && d.box.width > 40.0 &&
           std::abs(d.box.x - 143.5) < 1.0;
  });
  ASSERT_NE(piece, found.end());
  EXPECT_TRUE(piece->parted[kTop]) << "a like colour goes on there, and the outline jumps";
  EXPECT_TRUE(piece->cut[kTop] && piece->silhouette.samples[kTop].empty());
  EXPECT_FALSE(piece->cut[kLeft] || piece->cut[kBottom]);
}

TEST(PerceptionSilhouette, APieceHasNoSliverOfALeaningThingBesideIt) {
  cv::Mat bgr(240, 200, CV_8UC3, cv::Scalar(90, 90, 90));
  const cv::Scalar orange(0, 115, 255);
  cv::rectangle(bgr, cv::Rect(20, 30, 69, 201), orange, cv::FILLED);
  cv::rectangle(bgr, cv::Rect(89, 135, 3, 26), orange, cv::FILLED);  // leans out below the target
  cv::rectangle(bgr, cv::Rect(80, 90, 28, 45), orange, cv::FILLED);
  Detection joined;
  joined.mask_box = {20, 30, 88, 201};
  cv::inRange(bgr(joined.mask_box), orange, orange, joined.mask);
  bool found = false;
  for (const auto& piece : Split(bgr, joined))
    found = found || (piece.mask_box.y == 90 && piece.mask_box.height == 45 &&
                      piece.mask_box.br().x == 108 && piece.cut[kLeft]);
  EXPECT_TRUE(found);
}

TEST(PerceptionSilhouette, APartedSideStaysOneInASmallerPiece) {
  cv::Mat image = Grey();
  cv::rectangle(image, {100, 60}, {140, 130}, kOrangeBgr, cv::FILLED);
  const auto whole = ColorDetector(DetectorConfig{}, 0.45).Detect(image).at(0);
  auto left = CropTo(image, whole, {0, 0, 120, 240});
  ASSERT_TRUE(left && left->goes_on[kRight]);
  left->parted[kRight] = true;
  const auto lower = CropTo(image, *left, {0, 90, 376, 150});
  ASSERT_TRUE(lower);
  EXPECT_TRUE(lower->goes_on[kRight] && lower->parted[kRight] && lower->cut[kRight]);
  EXPECT_TRUE(lower->silhouette.samples[kRight].empty());
  EXPECT_TRUE(lower->goes_on[kTop]);
  EXPECT_FALSE(lower->parted[kTop] || lower->goes_on[kLeft] || lower->goes_on[kBottom]);
  const auto narrower = CropTo(image, *left, {0, 0, 110, 240});
  ASSERT_TRUE(narrower);
  EXPECT_TRUE(narrower->goes_on[kRight]);
  EXPECT_FALSE(narrower->parted[kRight]) << "cut anew, where nothing parts it";
}

TEST(PerceptionSilhouette, SidesAtTheImagesBorderAreCut) {
  cv::Mat image = Grey();
  cv::rectangle(image, {0, 80}, {25, 150}, kOrangeBgr, cv::FILLED);
  const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].cut[kLeft]);
  EXPECT_TRUE(found[0].silhouette.samples[kLeft].empty());
  EXPECT_FALSE(found[0].silhouette.samples[kRight].empty());
}

TEST(PerceptionSilhouette, ACropIsCutWhereTheWindowEnds) {
  cv::Mat image = Grey();
  cv::rectangle(image, {100, 60}, {140, 130}, kOrangeBgr, cv::FILLED);
  const auto whole = ColorDetector(DetectorConfig{}, 0.45).Detect(image).at(0);
  const auto left = CropTo(image, whole, {0, 0, 120, 240});
  const auto right = CropTo(image, whole, {120, 0, 256, 240});
  ASSERT_TRUE(left && right);
  EXPECT_TRUE(left->cut[kRight]);
  EXPECT_FALSE(left->cut[kLeft]);
  EXPECT_FALSE(CropTo(image, whole, {200, 0, 50, 240}));
}

TEST(PerceptionShape, ACylinderBeatsABallAndABoard) {
  cv::Mat image = Grey();
  cv::rectangle(image, {60, 60}, {86, 106}, kOrangeBgr, cv::FILLED);
  cv::circle(image, {180, 90}, 30, kOrangeBgr, cv::FILLED);
  cv::rectangle(image, {260, 60}, {350, 80}, kOrangeBgr, cv::FILLED);
  const auto found = ColorDetector(DetectorConfig{}, 0.45).Detect(image);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].mask_box.x, 60);
  for (size_t i = 1; i < found.size(); ++i) EXPECT_LT(found[i].score, 0.6 * found[0].score);
}

TEST(PerceptionImage, EveryFaultIsNamed) {
  const world::Rig rig;
  const cv::Mat good = Renderer(GymWorld(1)).Image(0.0).bgr;
  EXPECT_EQ(ImageProblem(good, rig), "");
  EXPECT_NE(ImageProblem({}, rig), "");
  EXPECT_NE(ImageProblem(cv::Mat(240, 376, CV_16UC3, cv::Scalar::all(9)), rig), "");
  EXPECT_NE(ImageProblem(cv::Mat(240, 376, CV_8UC1, cv::Scalar(9)), rig), "");
  EXPECT_NE(ImageProblem(cv::Mat(120, 188, CV_8UC3, cv::Scalar::all(90)), rig), "");
  EXPECT_EQ(ImageProblem(Grey(0), rig), "image is black");
  EXPECT_EQ(ImageProblem(Grey(255), rig), "image is saturated");
  cv::Mat torn = good.clone();
  torn.rowRange(150, 240).setTo(cv::Scalar::all(0));
  EXPECT_EQ(ImageProblem(torn, rig), "image lacks rows");
}

/// A picture of the marker, `side_px` wide, its corner at (u, v), on white.
cv::Mat MarkerImage(const std::string& name, int id, int side_px, int u, int v) {
  const int code = name == "DICT_4X4_50" ? cv::aruco::DICT_4X4_50 : cv::aruco::DICT_APRILTAG_36h11;
  cv::Mat marker, image = Grey(220);
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(code), id, side_px, marker, 1);
  cv::cvtColor(marker, marker, cv::COLOR_GRAY2BGR);
  marker.copyTo(image(cv::Rect(u, v, side_px, side_px)));
  return image;
}

TEST(PerceptionMarker, ArUcoAndAprilTagGiveThePosition) {
  for (const std::string name : {"DICT_4X4_50", "DICT_APRILTAG_36h11"}) {
    MarkerConfig config;
    config.dictionary = name;
    config.id = 7;
    config.depth = 0.0;
    const MarkerDetector detector(config, {});
    const auto found = detector.Detect(MarkerImage(name, 7, 44, 210, 90));
    ASSERT_EQ(found.size(), 1u) << name;
    ASSERT_TRUE(found[0].p_CT);
    // 44 px wide at 220 px focal length: 0.2 m is 1 m away; centre at pixel (231.5, 111.5).
    const Eigen::Vector3d expected(0.2, -8.0 / 220.0, 1.0);
    EXPECT_LT((*found[0].p_CT - expected).norm(), 0.03) << found[0].p_CT->transpose();
    EXPECT_TRUE(detector.Detect(MarkerImage(name, 8, 44, 210, 90)).empty()) << "another marker";
    EXPECT_TRUE(detector.Detect(Grey()).empty());
  }
}

TEST(PerceptionMarker, UnknownDictionaryIsRefusedWithTheKnownOnes) {
  MarkerConfig config;
  config.dictionary = "DICT_NONE";
  try {
    MarkerDetector detector(config, {});
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("DICT_4X4_50"), std::string::npos);
  }
}

TEST(PerceptionMarker, AnIdThatTheDictionaryLacksIsRefused) {
  MarkerConfig config;
  for (const int id : {-1, 0, 49}) {
    config.id = id;
    EXPECT_NO_THROW(MarkerDetector(config, {})) << id;
  }
  config.id = 50;
  try {
    MarkerDetector detector(config, {});
    FAIL();
  } catch (const std::runtime_error& e) {
    for (const char* said : {"marker.id is 50", "DICT_4X4_50", "0 to 49", "-1"})
      EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
  }
}

struct DocOf {
  std::string field, doc;

  template <class T>
  void operator()(const char* name, T&, const char* text) {
    if (field == name) doc = text;
  }
};

TEST(PerceptionMarker, EveryKnownDictionaryIsNamedInTheDoc) {
  MarkerConfig config;
  DocOf visitor{"dictionary", ""};
  config.Visit(visitor);
  config.dictionary = "DICT_NONE";
  std::string message;
  try {
    MarkerDetector detector(config, {});
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  int known = 0;
  std::istringstream words(message.substr(message.find("known are")));
  for (std::string word; words >> word;) {
    if (word.rfind("DICT_", 0) != 0) continue;
    EXPECT_NE(visitor.doc.find(word), std::string::npos) << word;
    ++known;
  }
  EXPECT_EQ(known, 7);
}

}  // namespace
}  // namespace chase::perception
