#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "../fcu/stand_in.h"
#include "common/math/rotation.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {

inline constexpr int64_t kFlightStart = 1'700'000'000'000'000;

inline ::testing::AssertionResult Holds(const std::string& text, const std::string& part) {
  return ::testing::AssertionResult(text.find(part) != std::string::npos) << text;
}

/// One that hovers.
inline Setpoint Hover() {
  Setpoint setpoint;
  setpoint.motors = true;
  setpoint.thrust = 9.81;
  return setpoint;
}

/// The bridge and the stand-in on a link with a delay, in logical time; POSE is the truth, and
/// setpoints come from a hand-written controller: climb to `height`, or nothing.
class Flight {
 public:
  explicit Flight(const StandInOptions& options = {}, const FcuConfig& config = {},
                  uint64_t seed = 1)
      : bridge(config), px4(options, kFlightStart, seed), random_(seed) {}

  Bridge bridge;
  StandIn px4;
  bool setpoints = true, motors = true, poses = true, link = true;
  bool bridge_runs = true;
  bool deaf = false;   ///< the bridge hears nothing
  bool idle = false;   ///< level without thrust, as control asks for before a plan begins
  bool usable = true;  ///< the poses
  int heartbeats = 0;  ///< of the autopilot
  double height = 1.5, aside = 0.0;
  int32_t epoch = 0;    ///< of odometry's frame W
  double turned = 0.0;  ///< yaw of the autopilot's frame in W, rad
  double loss = 0.0;    ///< probability that a datagram is lost, each way
  int64_t delay = 300;  ///< us, of each datagram, and up to 400 more
  std::vector<ImuSample> imu;
  std::vector<double> imu_errors;  ///< s: stamp against when it was measured
  std::vector<std::string> states;

  void Run(
      double seconds, const std::function<bool()>& until = [] { return false; }) {
    const int64_t end = now_ + static_cast<int64_t>(1e6 * seconds);
    while (now_ < end && !until()) Step();
  }
  bool RunUntil(Handshake::State wanted, double seconds) {
    Run(seconds, [&] { return state() == wanted; });
    return state() == wanted;
  }
  /// Until it flies, and on for `seconds`.
  void TakeOff(double seconds) {
    EXPECT_TRUE(RunUntil(Handshake::State::kFlying, 12.0)) << bridge.Words();
    Run(seconds);
  }
  Handshake::State state() const { return bridge.handshake().state(); }
  ::testing::AssertionResult Says(const std::string& words) const {
    return Holds(bridge.Words(), words);
  }
  int64_t now() const { return now_; }

 private:
  struct Datagram {
    int64_t arrival;
    std::vector<uint8_t> bytes;
  };

  void Step() {
    now_ += 2'500;
    px4.Tick(now_);
    auto sent = px4.TakeOutgoing();
    for (const auto& bytes : sent)
      heartbeats += bytes[0] == 0xFD && bytes[7] + bytes[8] + bytes[9] == 0;
    Carry(std::move(sent), &to_us_);
    if (bridge_runs) RunBridge();
    for (; !to_px4_.empty() && to_px4_.front().arrival <= now_; to_px4_.pop_front())
      px4.Receive(to_px4_.front().arrival, to_px4_.front().bytes);
  }

  void RunBridge() {
    for (; !to_us_.empty() && to_us_.front().arrival <= now_; to_us_.pop_front())
      bridge.Receive(to_us_.front().arrival, now_, to_us_.front().bytes.data(),
                     to_us_.front().bytes.size(), true);
    if (now_ % 5'000 == 0) Feed();
    bridge.Tick(now_);
    Carry(bridge.TakeOutgoing(), &to_px4_);
    for (const ImuSample& sample : bridge.TakeImu()) imu.push_back(sample);
    const std::string name = Handshake::Name(bridge.handshake().state());
    if (states.empty() || states.back() != name) states.push_back(name);
  }

  void Carry(std::vector<std::vector<uint8_t>> from, std::deque<Datagram>* to) {
    for (auto& bytes : from) {
      if (!link || (deaf && to == &to_us_) || random_.Uniform() < loss) continue;
      const int64_t queue = static_cast<int64_t>(400.0 * random_.Uniform());
      const int64_t arrival = std::max(now_ + delay + queue, to->empty() ? 0 : to->back().arrival);
      to->push_back({arrival, std::move(bytes)});
    }
  }

  void Feed() {
    if (poses) {
      Pose pose;
      pose.utime = now_;
      pose.epoch = epoch;
      pose.p_WB = px4.p_WB();
      pose.v_WB = px4.v_WB();
      pose.R_WB = px4.R_WB();
      pose = Turned(pose, turned);
      pose.covariance = Matrix9d::Identity() * 1e-4;
      pose.usable = usable;
      bridge.OnPose(pose, now_);
    }
    if (!setpoints) return;
    Setpoint setpoint;
    const Eigen::Vector3d goal(aside, 0, height);
    const Eigen::Vector3d a = 2.0 * (goal - px4.p_WB()) - 2.5 * px4.v_WB();
    const Eigen::Vector3d force = a.cwiseMax(-3.0).cwiseMin(3.0) + Eigen::Vector3d(0, 0, 9.81);
    setpoint.R_WB = math::FromYaw(turned) * math::FromZAxisAndYaw(force, 0.0);
    setpoint.thrust = force.norm();
    if (idle) setpoint.R_WB = math::FromYaw(turned), setpoint.thrust = 0.0;
    setpoint.motors = motors;
    bridge.OnSetpoint(setpoint, now_, now_);
  }

  world::Random random_;
  int64_t now_ = kFlightStart;
  std::deque<Datagram> to_us_, to_px4_;
};

/// Flies on until it holds, `most` s at most; prints and returns how long that took, s.
inline double Took(Flight* flight, const char* what, double most,
                   const std::function<bool()>& holds) {
  const int64_t begin = flight->now();
  flight->Run(most, holds);
  EXPECT_TRUE(holds()) << what << ": " << flight->bridge.Words();
  const double seconds = 1e-6 * static_cast<double>(flight->now() - begin);
  std::printf("%s: %.2f s\n", what, seconds);
  return seconds;
}

inline double Took(Flight* flight, const char* what, double most, Handshake::State state) {
  return Took(flight, what, most, [&] { return flight->state() == state; });
}

}  // namespace chase::fcu::testing
