#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

#include "common/logs/foxglove.h"
#include "common/logs/foxglove_scene.h"
#include "common/world/forecast.h"

namespace chase::logs {
namespace {

/// A protobuf message's parts by field number: nested messages and texts as bytes, doubles as such.
struct Parts {
  std::map<int, std::vector<std::string>> nested;
  std::map<int, double> doubles;
};

uint64_t Varint(const std::string& bytes, size_t* at) {
  uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    const auto byte = static_cast<uint8_t>(bytes.at((*at)++));
    value |= uint64_t{byte & 0x7fU} << shift;
    if (byte < 0x80) return value;
  }
}

Parts PartsOf(const std::string& bytes) {
  Parts parts;
  for (size_t at = 0; at < bytes.size();) {
    const uint64_t tag = Varint(bytes, &at);
    const int field = static_cast<int>(tag >> 3), kind = static_cast<int>(tag & 7);
    if (kind == 0) {
      Varint(bytes, &at);
    } else if (kind == 1) {
      std::memcpy(&parts.doubles[field], bytes.data() + at, 8);
      at += 8;
    } else {
      const size_t size = Varint(bytes, &at);
      parts.nested[field].push_back(bytes.substr(at, size));
      at += size;
    }
  }
  return parts;
}

/// Primitives of the scene's one entity by SceneEntity's number.
std::map<int, std::vector<std::string>> Drawn(const std::string& scene) {
  return PartsOf(PartsOf(scene).nested.at(2).at(0)).nested;
}

constexpr int kArrows = 7, kCubes = 8, kSpheres = 9, kLines = 11;
constexpr int kSize = 2, kPoints = 5, kColor = 6;  // of a solid; of a line

polynomial_t Along(double x, double y) {  // x y covered in a second
  polynomial_t p{};
  p.duration = 1.0;
  p.n_coefficients = 6;
  p.coefficients = {0, 0, 0, x, y, 0};
  return p;
}

TEST(FoxgloveScene, AMoverHasAnArrowAsLongAsItsWay) {
  obstacle_t mover{};
  mover.kind = obstacle_t::MOVING;
  mover.solid = obstacle_t::BOX;
  mover.half[0] = mover.half[1] = mover.half[2] = 0.5;
  mover.orientation[0] = 1.0;
  mover.shape[0] = mover.shape[3] = mover.shape[5] = 1.0;
  mover.center = Along(3, 4);
  obstacles_t m{};
  m.obstacles = {mover, mover};
  m.obstacles[1].kind = obstacle_t::STATIC;
  auto drawn = Drawn(SceneOf(m));
  EXPECT_EQ(drawn[kCubes].size(), 2U);
  ASSERT_EQ(drawn[kArrows].size(), 1U);
  const Parts arrow = PartsOf(drawn[kArrows][0]);
  EXPECT_DOUBLE_EQ(arrow.doubles.at(2) + arrow.doubles.at(4), 5.0);
}

TEST(FoxgloveScene, ObstaclesAreGrownByTheRadiusOfTheirVehiclesLastPlan) {
  obstacle_t box{};
  box.kind = obstacle_t::STATIC;
  box.solid = obstacle_t::BOX;
  box.half[0] = box.half[1] = box.half[2] = 0.5;
  box.orientation[0] = 1.0;
  box.shape[0] = box.shape[3] = box.shape[5] = 1.0;
  box.center = Along(0, 0);
  obstacle_t ground = box, ball = box;
  ground.kind = obstacle_t::GROUND;
  ball.solid = obstacle_t::ELLIPSOID;
  obstacles_t m{};
  m.obstacles = {box, ground, ball};
  m.n_obstacles = 3;
  m.vehicle = "v1/";
  std::vector<uint8_t> bytes(static_cast<size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  const auto grown = [&](const ViewerOptions& options) {
    for (const ViewerMessage& drawn : ToViewer({1, "v1/OBSTACLES", bytes}, options))
      if (drawn.topic == "v1/OBSTACLES/grown") return Drawn(drawn.bytes);
    return std::map<int, std::vector<std::string>>();
  };
  EXPECT_EQ(grown({}).count(kCubes), 0U) << "no plan was heard";
  ViewerOptions options;
  options.hard_radius = {{"v1/", 0.3}, {"v2/", 7.0}};
  auto drawn = grown(options);
  ASSERT_EQ(drawn[kCubes].size(), 1U) << "without the ground";
  ASSERT_EQ(drawn[kSpheres].size(), 1U);
  const auto width = [](const std::string& solid) {
    return PartsOf(PartsOf(solid).nested.at(kSize).at(0)).doubles.at(1);
  };
  EXPECT_NEAR(width(drawn[kCubes][0]), 2 * (0.5 + 0.3), 1e-9);
  EXPECT_NEAR(width(drawn[kSpheres][0]), 2 * (1.0 + 0.3), 1e-9);
}

TEST(FoxgloveScene, ATargetHasThreeSigmaAsLongAsItIsKnown) {
  target_t m{};
  m.covariance[0] = 0.01;
  m.covariance[4] = 0.04;
  m.covariance[8] = 0.09;
  m.state = target_t::LOST;
  EXPECT_EQ(Drawn(SceneOf(m)).count(kSpheres), 0U);
  m.state = target_t::TRACKING;
  const Parts size = PartsOf(PartsOf(Drawn(SceneOf(m))[kSpheres].at(0)).nested.at(kSize).at(0));
  EXPECT_NEAR(size.doubles.at(1), 0.6, 1e-9);
  EXPECT_NEAR(size.doubles.at(2), 1.2, 1e-9);
  EXPECT_NEAR(size.doubles.at(3), 1.8, 1e-9);
}

TEST(FoxgloveScene, APlanHasItsVerdictsColourAndItsStop) {
  plan_t m{};
  m.position = Along(1, 0);
  const std::string chase = PartsOf(Drawn(SceneOf(m))[kLines].at(0)).nested.at(kColor).at(0);
  m.verdict = plan_t::BRAKE;
  m.stop = Along(0.5, 0);
  auto lines = Drawn(SceneOf(m))[kLines];
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_NE(PartsOf(lines[0]).nested.at(kColor).at(0), chase);
  EXPECT_GT(PartsOf(lines[1]).doubles.at(3), PartsOf(lines[0]).doubles.at(3)) << "thickness";
  m.verdict = -1;  // of nobody
  EXPECT_EQ(Drawn(SceneOf(m))[kLines].size(), 2U);
}

TEST(FoxgloveScene, AForecastWidens) {
  prediction_t m{};
  EXPECT_EQ(Drawn(SceneOf(m)).count(kLines), 0U);
  m.target = Along(1, 0);
  m.covariance[0] = m.covariance[4] = m.covariance[8] = 0.01;
  m.velocity_covariance[0] = 0.03;
  const auto spheres = Drawn(SceneOf(m))[kSpheres];
  const Parts last = PartsOf(PartsOf(spheres.back()).nested.at(kSize).at(0));
  const double deviation = std::sqrt(0.04 + world::kTargetManoeuvre.Variance(1.0));
  EXPECT_NEAR(std::max({last.doubles.at(1), last.doubles.at(2), last.doubles.at(3)}), 4 * deviation,
              1e-9);
}

TEST(FoxgloveScene, AFencesEdges) {
  geofence_t m{};
  EXPECT_EQ(Drawn(SceneOf(m)).count(kLines), 0U);
  m.corners = {0, 0, 4, 0, 4, 3};
  m.ceiling = 5;
  const auto lines = Drawn(SceneOf(m))[kLines];
  EXPECT_EQ(PartsOf(lines.at(0)).nested.at(kPoints).size(), 18U);
}

}  // namespace
}  // namespace chase::logs
