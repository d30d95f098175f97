#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "perception_world.h"
#include "services/perception/color_detector.h"
#include "services/perception/image_check.h"
#include "services/perception/marker_detector.h"
#include "services/perception/network_detector.h"
#include "services/perception/silhouette.h"

namespace chase::perception {
namespace {

using perception_test::GymWorld;
using perception_test::Renderer;
using perception_test::StillWorld;

cv::Mat Grey(int level = 120) { return {240, 376, CV_8UC3, cv::Scalar(level, level, level)}; }

const cv::Scalar kOrangeBgr(12, 105, 235);

TEST(PerceptionColor, ScoresOrangeAndNotItsNeighbours) {
  const ColorModel model{ColorConfig{}};
  EXPECT_GT(model.Score(0.05, 0.45, 1.0), 0.99);
  EXPECT_GT(model.Score(0.02, 0.18, 0.4), 0.99) << "in shade";
  EXPECT_LT(model.Score(0.5, 0.5, 0.5), 0.01) << "grey";
  EXPECT_LT(model.Score(0.05, 0.05, 0.9), 0.5) << "red";
  EXPECT_LT(model.Score(0.1, 0.9, 0.9), 0.5) << "yellow";
  EXPECT_LT(model.Score(0.21, 0.28, 0.36), 0.5) << "bark";
}

TEST(PerceptionColor, RangeOfHueMayWrap) {
  ColorConfig config;
  config.hue_min_deg = 350;
  config.hue_max_deg = 10;
  const ColorModel model(config);
  EXPECT_GT(model.Score(0.05, 0.0, 1.0), 0.99);
  EXPECT_GT(model.Score(0.0, 0.05, 1.0), 0.99);
  EXPECT_LT(model.Score(0.05, 0.45, 1.0), 0.01);
}

TEST(PerceptionColor, AFullCircleLetsEveryHuePass) {
  ColorConfig config;
  config.hue_min_deg = 0;
  config.hue_max_deg = 360;
  ASSERT_EQ(config.Problem(), "");
  const ColorModel model(config);
  EXPECT_GT(model.Score(0.0, 0.0, 1.0), 0.99) << "red";
  EXPECT_GT(model.Score(0.0, 1.0, 0.5), 0.99) << "green";
  EXPECT_GT(model.Score(1.0, 1.0, 0.0), 0.99) << "cyan";
  EXPECT_GT(model.Score(1.0, 0.0, 0.5), 0.99) << "violet";
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
    const ColorConfig learned = LearnColor({bgr}, {mask}, {});
    ASSERT_EQ(learned.Problem(), "");
    const double width = std::fmod(learned.hue_max_deg - learned.hue_min_deg + 360.0, 360.0);
    EXPECT_NEAR(width, 0.94 * 20.0, 1.5) << middle;
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

TEST(PerceptionSilhouette, CropAndMergeAreInverse) {
  cv::Mat image = Grey();
  cv::rectangle(image, {100, 60}, {140, 130}, kOrangeBgr, cv::FILLED);
  const auto whole = ColorDetector(DetectorConfig{}, 0.45).Detect(image).at(0);
  const auto left = CropTo(image, whole, {0, 0, 120, 240});
  const auto right = CropTo(image, whole, {120, 0, 256, 240});
  ASSERT_TRUE(left && right);
  EXPECT_TRUE(left->cut[kRight]);
  EXPECT_FALSE(left->cut[kLeft]);
  EXPECT_FALSE(CropTo(image, whole, {200, 0, 50, 240}));
  const auto merged = Merge(image, {*left, *right});
  EXPECT_EQ(merged.mask_box, whole.mask_box);
  EXPECT_EQ(merged.goes_on, (std::array<bool, 4>{}));
  EXPECT_EQ(cv::countNonZero(merged.mask != whole.mask), 0);
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

/// Just enough of the protocol buffers' wire format to write an ONNX file.
class Proto {
 public:
  Proto& Int(int field, uint64_t value) {
    Varint(static_cast<uint64_t>(field) << 3);
    Varint(value);
    return *this;
  }
  Proto& Bytes(int field, const std::string& bytes) {
    Varint(static_cast<uint64_t>(field) << 3 | 2);
    Varint(bytes.size());
    text_ += bytes;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  void Varint(uint64_t v) {
    for (; v >= 128; v >>= 7) text_ += static_cast<char>(v | 128);
    text_ += static_cast<char>(v);
  }
  std::string text_;
};

template <class T>
std::string Tensor(const std::string& name, std::vector<uint64_t> dims, int type,
                   const std::vector<T>& values) {
  Proto p;
  for (const auto d : dims) p.Int(1, d);
  std::string raw(values.size() * sizeof(T), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return p.Int(2, static_cast<uint64_t>(type)).Bytes(8, name).Bytes(9, raw).text();
}

std::string Integer(const std::string& name, uint64_t value) {
  return Proto().Bytes(1, name).Int(3, value).Int(20, 2).text();
}

std::string Operation(const std::string& type, const std::vector<std::string>& in,
                      const std::string& out, const std::string& attribute = {}) {
  Proto p;
  for (const auto& i : in) p.Bytes(1, i);
  p.Bytes(2, out).Bytes(3, type + "_" + out).Bytes(4, type);
  if (!attribute.empty()) p.Bytes(5, attribute);
  return p.text();
}

std::string Value(const std::string& name, const std::vector<uint64_t>& dims) {
  Proto shape;
  for (const auto d : dims) shape.Bytes(1, Proto().Int(1, d).text());
  const std::string type = Proto().Bytes(1, Proto().Int(1, 1).Bytes(2, shape.text()).text()).text();
  return Proto().Bytes(1, name).Bytes(2, type).text();
}

constexpr int kNetWidth = 47, kNetHeight = 30;

const std::vector<float> kBoxBias = {0.0f, 0.0f, 4.0f, 6.0f, 0.0f};

/// A network of one linear layer: the centre of mass of (red - blue), for blobs of known mass.
void WriteNetwork(const std::string& file, double mass, const std::vector<float>& bias = kBoxBias,
                  const std::vector<int64_t>& shape = {1, 1, 5}) {
  constexpr size_t kInputs = 3 * kNetWidth * kNetHeight;
  std::vector<float> weights(kInputs * 5, 0.0f);
  for (int channel : {0, 2})
    for (int y = 0; y < kNetHeight; ++y)
      for (int x = 0; x < kNetWidth; ++x) {
        const auto in = static_cast<size_t>((channel * kNetHeight + y) * kNetWidth + x);
        const double unit = (channel == 0 ? 1.0 : -1.0) / mass;
        weights[in] = static_cast<float>(unit * (x + 0.5));
        weights[kInputs + in] = static_cast<float>(unit * (y + 0.5));
        weights[4 * kInputs + in] = static_cast<float>(unit);
      }
  Proto graph;
  graph.Bytes(1, Operation("Flatten", {"image"}, "flat"));
  graph.Bytes(1, Operation("Gemm", {"flat", "weights", "bias"}, "row", Integer("transB", 1)));
  graph.Bytes(1, Operation("Reshape", {"row", "shape"}, "boxes"));
  graph.Bytes(2, "tiny");
  graph.Bytes(5, Tensor("weights", {5, kInputs}, 1, weights));
  graph.Bytes(5, Tensor("bias", {5}, 1, bias));
  graph.Bytes(5, Tensor<int64_t>("shape", {shape.size()}, 7, shape));
  graph.Bytes(11, Value("image", {1, 3, kNetHeight, kNetWidth}));
  graph.Bytes(12, Value("boxes", {shape.begin(), shape.end()}));
  const std::string model = Proto()
                                .Int(1, 7)
                                .Bytes(8, Proto().Bytes(1, "").Int(2, 11).text())
                                .Bytes(7, graph.text())
                                .text();
  std::ofstream(file, std::ios::binary) << model;
}

NetworkConfig TinyNetwork() {
  NetworkConfig config;
  config.file = testing::TempDir() + "perception_tiny.onnx";
  config.input_width_px = kNetWidth;
  config.input_height_px = kNetHeight;
  return config;
}

TEST(PerceptionNetwork, BoxesComeFromAnOnnxFile) {
  const NetworkConfig config = TinyNetwork();
  // Orange (235 - 12) / 255 on 4 x 6 pixels of the network's input, 8 x 8 image pixels each.
  WriteNetwork(config.file, 24.0 * (235.0 - 12.0) / 255.0);
  const NetworkDetector detector(config, {});
  for (const cv::Point corner : {cv::Point(80, 64), cv::Point(240, 120)}) {
    cv::Mat image = Grey();
    cv::rectangle(image, cv::Rect(corner, cv::Size(32, 48)), kOrangeBgr, cv::FILLED);
    const auto found = detector.Detect(image);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].box.x, corner.x - 0.5, 0.5);
    EXPECT_NEAR(found[0].box.y, corner.y - 0.5, 0.5);
    EXPECT_NEAR(found[0].box.width, 32, 0.5);
    EXPECT_NEAR(found[0].box.height, 48, 0.5);
    EXPECT_NEAR(found[0].score, 1.0, 0.05);
    EXPECT_EQ(found[0].silhouette.samples[kLeft].size(), 1u);
  }
  EXPECT_TRUE(detector.Detect(Grey()).empty());
  std::filesystem::remove(config.file);
}

/// What the constructor says; empty when it takes the network.
std::string Refusal(const NetworkConfig& config) {
  try {
    NetworkDetector detector(config, {});
    return "";
  } catch (const std::runtime_error& e) {
    return e.what();
  }
}

TEST(PerceptionNetwork, OneThatDoesNotFitIsRefusedWhenItIsRead) {
  const NetworkConfig fits = TinyNetwork();
  const auto expect = [&](const NetworkConfig& config, const std::vector<std::string>& all) {
    const std::string message = Refusal(config);
    EXPECT_NE(message.find(config.file), std::string::npos) << message;
    for (const auto& said : all)
      EXPECT_NE(message.find(said), std::string::npos) << said << " in: " << message;
  };
  WriteNetwork(fits.file, 24.0);
  EXPECT_EQ(Refusal(fits), "");
  NetworkConfig config = fits;
  config.input_width_px = kNetWidth + 1;
  expect(config, {"48 x 30", "network.input_width_px"});
  config = fits;
  config.class_id = 1;
  expect(config, {"1 x 1 x 5", "network.class_id"});
  WriteNetwork(fits.file, 24.0, kBoxBias, {1, 5});
  expect(fits, {"1 x 5", "1 x N x (4 + classes)"});
  WriteNetwork(fits.file, 24.0, kBoxBias, {1, 5, 1});
  expect(fits, {"1 x 5 x 1", "1 x N x (4 + classes)"});
  WriteNetwork(fits.file, 24.0, {20.0f, 15.0f, 4.0f, 6.0f, 30.0f});
  expect(fits, {"1 x 1 x 5", "a score of 30", "transposed"});
  std::filesystem::remove(fits.file);
}

TEST(PerceptionNetwork, RowsThatAreNotFiniteAreLeftOut) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const NetworkConfig config = TinyNetwork();
  for (const float bad : {kNan, kInf, -kInf})
    for (size_t i = 0; i < 5; ++i) {
      std::vector<float> bias = {20.0f, 15.0f, 4.0f, 6.0f, 1.0f};
      WriteNetwork(config.file, 1e9, bias);
      ASSERT_EQ(NetworkDetector(config, {}).Detect(Grey()).size(), 1u);
      bias[i] = bad;
      WriteNetwork(config.file, 1e9, bias);
      EXPECT_TRUE(NetworkDetector(config, {}).Detect(Grey()).empty()) << bad << " at " << i;
    }
  std::filesystem::remove(config.file);
}

constexpr double kBoxRange = 2.0;  // m, from where the target of BoxWorld() fills the box below
constexpr int kBoxWidth = 32, kBoxHeight = 48;

/// A target that crosses on a circle around the camera.
perception_test::World BoxWorld() {
  auto world = StillWorld(kBoxRange);
  const double slope = 0.5 * kBoxWidth / world.rig.focal_px;
  world.target_radius = kBoxRange * std::sin(std::atan(slope));
  world.target_height = (kBoxRange - world.target_radius) * kBoxHeight / world.rig.focal_px;
  world.target = [](double t) {
    const double angle = 0.1 * t - 0.15;
    return Eigen::Vector3d(kBoxRange * std::cos(angle), kBoxRange * std::sin(angle), 1.0);
  };
  world.body = [](double) { return perception_test::Body{{0.0, 0.0, 1.0}}; };
  world.rig.camera_position.setZero();
  world.rig.camera_pitch_deg = 0.0;
  return world;
}

/// The target's box on grey.
void DrawBox(const perception_test::World& world, double t, cv::Mat* bgr) {
  const Eigen::Vector3d p_BT = world.target(t) - world.body(t).p;
  const Eigen::Vector2d px = world.rig.Project(world.rig.R_BC().transpose() * p_BT);
  const auto from = [](double middle, int size) {
    return static_cast<int>(std::lround(middle - 0.5 * (size - 1)));
  };
  *bgr = Grey();
  cv::rectangle(*bgr, {from(px.x(), kBoxWidth), from(px.y(), kBoxHeight), kBoxWidth, kBoxHeight},
                kOrangeBgr, cv::FILLED);
}

TEST(PerceptionNetwork, WhatItsBoxesShowIsTracked) {
  const std::string file = testing::TempDir() + "perception_tiny_flight.onnx";
  WriteNetwork(file, 24.0 * (235.0 - 12.0) / 255.0);
  const auto world = BoxWorld();
  PerceptionConfig config;
  config.rig = world.rig;
  config.target_radius = world.target_radius;
  config.target_height = world.target_height;
  config.detector.kind = "network";
  config.detector.network.file = file;
  config.detector.network.input_width_px = kNetWidth;
  config.detector.network.input_height_px = kNetHeight;
  perception_test::FlyOptions options;
  options.duration = 3.0;
  options.spoil_image = [&](double t, cv::Mat* bgr) { DrawBox(world, t, bgr); };
  for (const bool lidar : {false, true}) {
    options.lidar = lidar;
    for (const auto& o : perception_test::Fly(world, config, options)) {
      if (o.t < 1.0) continue;
      EXPECT_EQ(o.estimate.state, TargetState::kTracking) << "lidar " << lidar << ", " << o.t;
      const Eigen::Vector3d error = o.estimate.p_WT - o.truth;
      EXPECT_LT(error.dot(o.estimate.covariance.ldlt().solve(error)), 16.0)
          << "lidar " << lidar << ", " << o.t << " s, off by " << error.transpose() << " m";
    }
  }
  std::filesystem::remove(file);
}

TEST(PerceptionNetwork, MissingAndBrokenFilesAreRefused) {
  NetworkConfig config;
  config.file = testing::TempDir() + "perception_none.onnx";
  EXPECT_THROW(NetworkDetector(config, {}), std::runtime_error);
  std::ofstream(config.file) << "no network";
  EXPECT_THROW(NetworkDetector(config, {}), std::runtime_error);
  std::filesystem::remove(config.file);
}

}  // namespace
}  // namespace chase::perception
