// The network detector: small ONNX files written here, read, refused and flown.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "deploy/detect/picture.h"
#include "perception_world.h"
#include "services/perception/sight/network_detector.h"

namespace chase::perception {
namespace {

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
    cv::Mat image(240, 376, CV_8UC3, cv::Scalar::all(120));
    cv::rectangle(image, cv::Rect(corner, cv::Size(32, 48)), cv::Scalar(12, 105, 235), cv::FILLED);
    const auto found = detector.Detect(image);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].box.x, corner.x - 0.5, 0.5);
    EXPECT_NEAR(found[0].box.y, corner.y - 0.5, 0.5);
    EXPECT_NEAR(found[0].box.width, 32, 0.5);
    EXPECT_NEAR(found[0].box.height, 48, 0.5);
    EXPECT_NEAR(found[0].score, 1.0, 0.05);
    EXPECT_EQ(found[0].silhouette.samples[kLeft].size(), 1u);
  }
  EXPECT_TRUE(detector.Detect(cv::Mat(240, 376, CV_8UC3, cv::Scalar::all(120))).empty());
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
      ASSERT_EQ(NetworkDetector(config, {})
                    .Detect(cv::Mat(240, 376, CV_8UC3, cv::Scalar::all(120)))
                    .size(),
                1u);
      bias[i] = bad;
      WriteNetwork(config.file, 1e9, bias);
      EXPECT_TRUE(NetworkDetector(config, {})
                      .Detect(cv::Mat(240, 376, CV_8UC3, cv::Scalar::all(120)))
                      .empty())
          << bad << " at " << i;
    }
  std::filesystem::remove(config.file);
}

constexpr double kBoxRange = 2.0;  // m, from where the target of BoxWorld() fills the box below
constexpr int kBoxWidth = 32, kBoxHeight = 48;

/// A target that crosses on a circle around the camera.
perception_test::World BoxWorld() {
  auto world = perception_test::StillWorld(kBoxRange);
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
  *bgr = cv::Mat(240, 376, CV_8UC3, cv::Scalar::all(120));
  cv::rectangle(*bgr, {from(px.x(), kBoxWidth), from(px.y(), kBoxHeight), kBoxWidth, kBoxHeight},
                cv::Scalar(12, 105, 235), cv::FILLED);
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

TEST(PerceptionNetwork, ItsFileIsReadOnceForManyPictures) {
  PerceptionConfig config;
  config.detector.kind = "network";
  config.detector.network.file = testing::TempDir() + "perception_tiny_pictures.onnx";
  config.detector.network.input_width_px = kNetWidth;
  config.detector.network.input_height_px = kNetHeight;
  WriteNetwork(config.detector.network.file, 24.0 * (235.0 - 12.0) / 255.0);
  PictureDetector detector(config);
  std::filesystem::remove(config.detector.network.file);
  const cv::Mat grey(config.rig.height_px, config.rig.width_px, CV_8UC3, cv::Scalar::all(120));
  for (int i = 0; i < 2; ++i) EXPECT_NO_THROW(detector.Find(grey));
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
