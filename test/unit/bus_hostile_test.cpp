#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/bus/bus.h"

namespace chase::bus {
namespace {

/// A bus whose wire the test holds in its hand.
class WireBus : public Bus {
 public:
  int64_t Now() const override { return 0; }
  void Deliver(const Bytes& bytes) { handler_(bytes.data(), bytes.size()); }

 protected:
  void SubscribeRaw(const std::string&, RawHandler handler) override { handler_ = handler; }
  void PublishRaw(const std::string&, Bytes) override {}

 private:
  RawHandler handler_;
};

template <class T>
Bus::Bytes Encode(const T& message) {
  Bus::Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

polynomial_t GoodPolynomial() {
  polynomial_t p{};
  p.duration = 1.0;
  p.n_coefficients = 3;
  p.coefficients = {1.0, 2.0, 3.0};
  return p;
}

// One good message per type; Spoil puts a NaN, or what stands for one, into it.
template <class T>
struct Sample;

#define CHASE_SAMPLE(Type, good, spoil)   \
  template <>                             \
  struct Sample<Type> {                   \
    static Type Good() {                  \
      Type m{};                           \
      good;                               \
      return m;                           \
    }                                     \
    static void Spoil(Type& m) { spoil; } \
  };

const double kNan = std::numeric_limits<double>::quiet_NaN();
const float kNanF = std::numeric_limits<float>::quiet_NaN();

template <class T>
void FillCloud(T* m) {
  m->size = 2;
  m->x = m->y = m->z = {1.0f, 2.0f};
  m->intensity = m->ring = {1, 2};
}

CHASE_SAMPLE(imu_t, , m.gyro[1] = kNan)
CHASE_SAMPLE(attitude_setpoint_t, m.orientation[0] = 1.0, m.thrust = kNan)
CHASE_SAMPLE(lidar_scan_t, FillCloud(&m); m.t = m.x, m.x.assign(2, kNanF))
CHASE_SAMPLE(scan_registered_t, FillCloud(&m); m.orientation[0] = 1.0, m.pos[2] = kNan)
CHASE_SAMPLE(camera_image_t, m.width = 2; m.height = 2; m.row_stride = 2; m.size = 4;
             m.data.assign(4, 7), m.width = -1)
CHASE_SAMPLE(pose_t, m.orientation[0] = 1.0, m.vel[0] = kNan)
CHASE_SAMPLE(target_t, , m.mean[0] = kNan)
CHASE_SAMPLE(map_t, m.resolution = 0.1; m.size = 1; m.data = {1}, m.resolution = kNan)
CHASE_SAMPLE(prediction_t, m.target = GoodPolynomial(), m.target.coefficients[1] = kNan)
CHASE_SAMPLE(scenario_t, m.yaml = "name: x", m.yaml.clear())
CHASE_SAMPLE(command_t, m.n_arguments = 1; m.arguments = {1.0}, m.arguments[0] = kNan)
CHASE_SAMPLE(command_ack_t, m.reason = "not ready", m.verdict = 3)
CHASE_SAMPLE(flight_state_t, m.n_missing = 1; m.missing = {"POSE"}, m.home[2] = kNan)
CHASE_SAMPLE(geofence_t, m.ceiling = 1.0; m.n_corners = 6;
             m.corners.assign(6, 1.0), m.corners[3] = kNan)
CHASE_SAMPLE(selection_t, m.hue_max = 20.0, m.hue_max = kNan)
CHASE_SAMPLE(health_t, m.n_processes = 1; m.processes.resize(1), m.processes[0].age = kNan)
CHASE_SAMPLE(event_t, m.name = "kill-planning", m.phase = 2)
CHASE_SAMPLE(status_t, , m.cpu = kNan)
CHASE_SAMPLE(truth_t, m.orientation[0] = 1.0, m.pos[0] = kNan)
CHASE_SAMPLE(plan_t, m.position = m.target = GoodPolynomial(); m.n_yaw = 1;
             m.yaw = {0.0}, m.yaw[0] = kNan)

obstacle_t GoodObstacle() {
  obstacle_t o{};
  o.center = GoodPolynomial();
  o.shape[0] = o.shape[3] = o.shape[5] = 1.0;
  return o;
}
CHASE_SAMPLE(obstacles_t, m.n_obstacles = 1;
             m.obstacles = {GoodObstacle()}, m.obstacles[0].shape[0] = -1.0)
#undef CHASE_SAMPLE

template <class T>
class HostileBus : public testing::Test {};
using Types = testing::Types<imu_t, attitude_setpoint_t, lidar_scan_t, scan_registered_t,
                             camera_image_t, pose_t, target_t, map_t, prediction_t, scenario_t,
                             command_t, command_ack_t, flight_state_t, geofence_t, health_t,
                             event_t, selection_t, status_t, truth_t, plan_t, obstacles_t>;
TYPED_TEST_SUITE(HostileBus, Types);

/// Every truncation, every single corrupted byte position (among them all lengths set negative or
/// huge), a wrong fingerprint, rubbish, an empty message and a NaN.
template <class T>
std::vector<Bus::Bytes> Attacks(size_t* n_must_fail) {
  const T good = Sample<T>::Good();
  const Bus::Bytes bytes = Encode(good);
  std::vector<Bus::Bytes> attacks = {{}, Bus::Bytes(3, 0xff), Bus::Bytes(64, 0xff)};
  for (size_t n = 0; n < bytes.size(); ++n)
    attacks.emplace_back(bytes.begin(), bytes.begin() + static_cast<long>(n));
  Bus::Bytes fingerprint = bytes;
  fingerprint[0] ^= 0x55;
  attacks.push_back(fingerprint);
  T spoiled = good;
  Sample<T>::Spoil(spoiled);
  attacks.push_back(Encode(spoiled));
  *n_must_fail = attacks.size();
  for (size_t i = 8; i < bytes.size(); ++i)
    for (const uint8_t value : std::initializer_list<uint8_t>{0x7f, 0x80, 0xff}) {
      Bus::Bytes corrupt = bytes;
      corrupt[i] = value;
      attacks.push_back(corrupt);
    }
  return attacks;
}

TYPED_TEST(HostileBus, BadMessagesAreCountedAndTheNextGoodOneIsHandled) {
  WireBus bus;
  int handled = 0;
  bus.Subscribe<TypeParam>("CHANNEL", [&](const TypeParam&) { ++handled; });
  size_t n_must_fail = 0;
  const auto attacks = Attacks<TypeParam>(&n_must_fail);
  for (size_t i = 0; i < n_must_fail; ++i) bus.Deliver(attacks[i]);
  const auto& counters = bus.counters().at("CHANNEL");
  EXPECT_EQ(counters.malformed, static_cast<int64_t>(n_must_fail));
  EXPECT_EQ(handled, 0);
  EXPECT_FALSE(bus.last_error().empty());
  bus.Deliver(Encode(Sample<TypeParam>::Good()));
  EXPECT_EQ(handled, 1);
  for (size_t i = n_must_fail; i < attacks.size(); ++i) bus.Deliver(attacks[i]);  // must not crash
  EXPECT_EQ(counters.malformed + counters.received, static_cast<int64_t>(attacks.size()) + 1);
}

TEST(HostileBus, AHugeLengthIsRefusedBeforeItIsAllocated) {
  Bus::Bytes bytes = Encode(Sample<lidar_scan_t>::Good());
  bytes[8 + 8 + 4] = 0x7f;  // size becomes about two thousand million
  lidar_scan_t message;
  EXPECT_LT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  EXPECT_TRUE(message.x.empty());
}

TEST(HostileBus, ATextThatDoesNotEndAtItsOnlyZeroIsRefused) {
  event_t good{};
  good.name = "kill";
  const Bus::Bytes bytes = Encode(good);
  const auto text = std::search(bytes.begin(), bytes.end(), good.name.begin(), good.name.end());
  ASSERT_NE(text, bytes.end());
  event_t message;
  for (const auto& [at, byte] :
       {std::pair<int, uint8_t>{2, 0}, {4, '!'}}) {  // within it, or no zero at all
    Bus::Bytes spoiled = bytes;
    spoiled[static_cast<size_t>(text - bytes.begin() + at)] = byte;
    EXPECT_LT(message.decode(spoiled.data(), 0, static_cast<int>(spoiled.size())), 0) << at;
  }
}

/// Uncertainty that is negative would make room for a plan.
TEST(HostileBus, WhatIsNoCovarianceIsRefused) {
  const auto listed = [](double xx, double xy, double yy, double rate) {
    obstacles_t m = Sample<obstacles_t>::Good();
    obstacle_t& o = m.obstacles.at(0);
    const double entries[6] = {xx, xy, 0.0, yy, 0.0, 0.0};
    std::copy(entries, entries + 6, o.position_covariance);
    o.velocity_covariance[5] = rate;
    return Problem(m);
  };
  EXPECT_EQ(listed(0.0, 0.0, 0.0, 0.0), "");
  EXPECT_EQ(listed(0.01, 0.02, 0.04, 0.0), "") << "along one line";
  EXPECT_EQ(listed(-1e-4, 0.0, 0.01, 0.0),
            "field position_covariance is not positive semidefinite");
  EXPECT_EQ(listed(0.01, 0.0201, 0.04, 0.0),
            "field position_covariance is not positive semidefinite");
  EXPECT_EQ(listed(0.01, 0.0, 0.0, -1e-9),
            "field velocity_covariance is not positive semidefinite");
  prediction_t forecast = Sample<prediction_t>::Good();
  EXPECT_EQ(Problem(forecast), "");
  forecast.covariance[8] = -1e-3;
  EXPECT_EQ(Problem(forecast), "field covariance is not positive semidefinite");
}

TEST(HostileBus, ATextOfTheLeastLengthIsRefused) {
  Bus::Bytes bytes = Encode(event_t{});
  bytes[8 + 8 + 4] = 0x80;  // of the sender's name
  event_t message;
  for (const auto last :
       {uint8_t{0}, uint8_t{1}}) {  // -2^31, from which nothing can be taken, and one more
    bytes[8 + 8 + 4 + 3] = last;
    EXPECT_LT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  }
}

TEST(Bus, GapsInSeqAreCountedAsDrops) {
  WireBus bus;
  bus.Subscribe<imu_t>("IMU", [](const imu_t&) {});
  imu_t imu{};
  for (const int seq : {5, 6, 9, 10, 0, 1}) {  // two lost, then a restarted sender
    imu.seq = seq;
    bus.Deliver(Encode(imu));
  }
  EXPECT_EQ(bus.counters().at("IMU").dropped, 2);
  EXPECT_EQ(bus.counters().at("IMU").received, 6);
}

template <class T>
bool IsObeyed(const std::string& channel, const std::string& sender, const std::string& vehicle) {
  WireBus bus;
  bus.SetIdentity({"simulator", "falcon", 0});
  int handled = 0;
  bus.Subscribe<T>(channel, [&](const T&) { ++handled; });
  T message = Sample<T>::Good();
  message.sender = sender;
  message.vehicle = vehicle;
  bus.Deliver(Encode(message));
  EXPECT_EQ(bus.counters().at(channel).foreign, 1 - handled);
  return handled == 1;
}

TEST(Bus, CommandsOfStrangersAndOtherVehiclesAreLeftOut) {
  EXPECT_TRUE(IsObeyed<plan_t>("PLAN", "planning", "falcon"));
  EXPECT_TRUE(IsObeyed<attitude_setpoint_t>("ATTITUDE_SETPOINT", "control", "falcon"));
  for (const char* stranger : {"", "control2", "planning2", "simulator"}) {
    EXPECT_FALSE(IsObeyed<plan_t>("PLAN", stranger, "falcon")) << stranger;
    EXPECT_FALSE(IsObeyed<attitude_setpoint_t>("ATTITUDE_SETPOINT", stranger, "falcon"));
  }
  EXPECT_TRUE(IsObeyed<command_t>("COMMAND", "command", "falcon"));
  EXPECT_FALSE(IsObeyed<command_t>("COMMAND", "command", "eagle"));
  EXPECT_FALSE(IsObeyed<command_t>("COMMAND", "planning", "falcon"));
  EXPECT_TRUE(IsObeyed<flight_state_t>("FLIGHT_STATE", "mission", "falcon"));
  EXPECT_FALSE(IsObeyed<flight_state_t>("FLIGHT_STATE", "planning", "falcon"));
  EXPECT_FALSE(IsObeyed<plan_t>("PLAN", "control", "falcon"));
  EXPECT_FALSE(IsObeyed<plan_t>("PLAN", "planning", "eagle"));
  EXPECT_FALSE(IsObeyed<attitude_setpoint_t>("ATTITUDE_SETPOINT", "control", ""));
  EXPECT_TRUE(IsObeyed<imu_t>("IMU", "stand-in", "falcon"));
  EXPECT_FALSE(IsObeyed<imu_t>("IMU", "fcu", "eagle"));
}

TEST(Bus, AHandlerThatThrowsIsReportedAndContained) {
  WireBus bus;
  bus.Subscribe<imu_t>("IMU", [](const imu_t&) { throw std::runtime_error("inner"); });
  bus.Deliver(Encode(imu_t{}));
  EXPECT_NE(bus.last_error().find("inner"), std::string::npos);
}

}  // namespace
}  // namespace chase::bus
