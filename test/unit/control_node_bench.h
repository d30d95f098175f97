#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/status_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "services/control/control_node.h"

namespace chase::control::test {

inline constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

class Silent : public bus::Node {};

/// The node on an in-memory bus, with a hand on both ends.
class Bench {
 public:
  explicit Bench(bool hears_obstacles = true, const ControlConfig& config = {}) {
    lockstep_.Add("planning", 0, [this, hears_obstacles](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<attitude_setpoint_t>(
          "ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) { out.push_back(m); });
      bus.Subscribe<tracking_t>("TRACKING", [this](const tracking_t& m) { tracking.push_back(m); });
      bus.Subscribe<flight_state_t>("FLIGHT_STATE", [](const flight_state_t&) {});
      bus.Subscribe<flight_state_t>("HOME",
                                    [this](const flight_state_t& m) { homes.push_back(m); });
      if (hears_obstacles) bus.Subscribe<obstacles_t>("OBSTACLES", [](const obstacles_t&) {});
      return std::make_unique<Silent>();
    });
    lockstep_.Add("control", 0, [this, config](bus::Bus& bus) {
      auto node = std::make_unique<ControlNode>(bus, config);
      node_ = node.get();
      return node;
    });
  }

  /// A hover that nobody has certified: the last resort.
  static plan_t Hover(int64_t utime, const Eigen::Vector3d& p, double duration = 2.0) {
    plan_t m{};
    m.utime = utime;
    m.verdict = plan_t::WAIT;
    m.certified_clearance = -1.0;
    m.position = bus::ToMessage(
        world::Trajectory::Constant(p, bus::Seconds(utime, kStart), duration), kStart);
    m.target = m.position;
    m.n_yaw = 1;
    m.yaw = {0.0};
    return m;
  }
  void SendPlan(int64_t utime, const Eigen::Vector3d& p, double duration = 2.0) {
    Send(Hover(utime, p, duration));
  }
  void Send(const plan_t& plan) { bus_->Publish("PLAN", plan); }
  void Send(const obstacles_t& list) { bus_->Publish("OBSTACLES", list); }
  void Send(const pose_t& pose) {
    bus_->Publish("POSE", pose);
    RunUntil(pose.utime);
  }

  /// A hover that is certified off the wall that SendWall lists.
  static plan_t Certified(int64_t utime, const Eigen::Vector3d& p) {
    plan_t m = Hover(utime, p);
    m.verdict = plan_t::CHASE;
    m.certified_clearance = 0.1;
    m.hard_radius = ControlConfig{}.hard_radius();
    m.sigmas = ControlConfig{}.sigmas;
    m.n_proofs = 1;
    m.proofs.resize(1);
    m.proofs[0].obstacle = 7;
    m.proofs[0].radius = m.hard_radius;
    m.proofs[0].n_separations = 1;
    m.proofs[0].separations = {{0.0, 1.0, {-1.0, 0.0, 0.0}}};
    return m;
  }

  /// A wall 2 m ahead.
  void SendWall(int64_t utime, int32_t epoch = 0, int32_t n_cut = 0) {
    obstacles_t m{};
    m.utime = utime;
    m.epoch = epoch;
    m.n_cut = n_cut;
    m.n_obstacles = 1;
    world::Obstacle wall;
    wall.id = 7;
    wall.solid = world::Obstacle::Solid::kBox;
    wall.half = {0.1, 5.0, 5.0};
    wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    wall.center = world::Trajectory::Constant({2, 0, 0}, bus::Seconds(utime, kStart), 1.0);
    m.obstacles = {bus::ToMessage(wall, kStart)};
    Send(m);
  }

  void SendPose(int64_t utime, int8_t health = pose_t::HEALTH_OK, int32_t epoch = 0,
                double sigma = 0.0, double speed_sigma = 0.0) {
    pose_t m{};
    m.utime = utime;
    m.pos[2] = height;
    bus::Set(m.vel, velocity);
    m.epoch = epoch;
    m.orientation[0] = 1.0;
    m.health = health;
    for (int i = 0; i < 3; ++i) {
      m.local_covariance[10 * i] = sigma * sigma;
      m.local_covariance[10 * (i + 3)] = speed_sigma * speed_sigma;
    }
    Send(m);
  }

  void RunUntil(int64_t utime) {
    latest_ = std::max(latest_, utime);
    lockstep_.RunUntil(latest_);
  }
  void SendState(int8_t state, const std::string& sender = "mission",
                 const std::optional<Eigen::Vector3d>& home = {}, int64_t age = 0) {
    if (!mission_) mission_ = lockstep_.Connect();
    mission_->SetIdentity({sender, "", 0});
    flight_state_t m{};
    m.utime = mission_->Now() - age;
    m.state = state;
    m.has_home = home ? 1 : 0;
    if (home) bus::Set(m.home, *home);
    mission_->Publish("FLIGHT_STATE", m);
  }

  /// What the bridge says of the autopilot: "flying: ...; mode OFFBOARD, armed, in air".
  void SendAutopilot(const std::string& words) {
    if (!fcu_) fcu_ = lockstep_.Connect();
    fcu_->SetIdentity({"fcu", "", 0});
    status_t m{};
    m.utime = fcu_->Now();
    m.name = "fcu";
    m.detail = words;
    fcu_->Publish("FCU_STATUS", m);
  }

  /// A fence about the take-off place `home`.
  void SendFence(const Eigen::Vector3d& home, int32_t epoch = 0) {
    geofence_t m{};
    m.epoch = epoch;
    for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      m.corners.push_back(home.x() + x);
      m.corners.push_back(home.y() + y);
    }
    m.n_corners = static_cast<int32_t>(m.corners.size());
    m.floor = home.z() - 1.0;
    m.ceiling = home.z() + 2.0;
    mission_->Publish("GEOFENCE", m);
  }

  double height = 0.0;                                 ///< of the body by its poses, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< the same, m/s
  const ControlNode& node() const { return *node_; }
  std::vector<attitude_setpoint_t> out;
  std::vector<tracking_t> tracking;
  std::vector<flight_state_t> homes;

 private:
  int64_t latest_ = kStart;
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  ControlNode* node_ = nullptr;
  std::unique_ptr<bus::Bus> mission_, fcu_;
};

}  // namespace chase::control::test
