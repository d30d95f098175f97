#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "chase/command_ack_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/health_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "services/mission/mission_node.h"

namespace chase::mission {

inline constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

/// Stands in for a process: its status comes once a second by itself.
class Silent : public bus::Node {};

/// The node on an in-memory bus among stand-ins.
class NodeBench {
 public:
  /// `battery`: does the mission want to be told of one?
  explicit NodeBench(MissionConfig config = {}, bool battery = false) {
    if (!battery) config.battery_low = config.battery_critical = 0.0;
    for (const char* name : {"prediction", "planning", "control"})
      lockstep.Add(name, 0, [](bus::Bus&) { return std::make_unique<Silent>(); });
    lockstep.Add("mission", 0,
                 [config](bus::Bus& bus) { return std::make_unique<MissionNode>(bus, config); });
    lockstep.Add("listener", 0, [this](bus::Bus& bus) {
      bus.Subscribe<flight_state_t>("FLIGHT_STATE", [this](const auto& m) { states.push_back(m); });
      bus.Subscribe<command_ack_t>("COMMAND_ACK", [this](const auto& m) { acks.push_back(m); });
      bus.Subscribe<health_t>("HEALTH", [this](const auto& m) { healths.push_back(m); });
      bus.Subscribe<geofence_t>("GEOFENCE", [this](const auto& m) { fences.push_back(m); });
      return std::make_unique<Silent>();
    });
    sensors_ = lockstep.Connect();
    operator_ = lockstep.Connect();
    operator_->SetIdentity({"command", "", kStart});
  }

  void Run(double seconds) {
    for (const int64_t end = lockstep.now() + std::llround(seconds * 1e6); lockstep.now() < end;) {
      const int64_t t = lockstep.now() + 20'000;
      pose_t pose{};
      pose.utime = t;
      pose.orientation[0] = 1.0;
      pose.health = health;
      bus::Set(pose.pos, place);
      sensors_->Publish("POSE", pose);
      obstacles_t obstacles{};
      obstacles.utime = t;
      obstacles.n_cut = n_cut;
      sensors_->Publish("OBSTACLES", obstacles);
      target_t target{};
      target.utime = t;
      target.state = target_t::TRACKING;
      sensors_->Publish("TARGET", target);
      prediction_t prediction{};
      prediction.utime = t;
      prediction.target = bus::ToMessage(world::Trajectory::Constant({5, 0, 1}, 0.0, 1.0), t);
      if (forecasts) sensors_->Publish("PREDICTION", prediction);
      lockstep.RunUntil(t);
    }
  }

  void Command(int8_t kind, int64_t id, const std::string& vehicle = "") {
    command_t m{};
    m.utime = lockstep.now();
    m.id = id;
    m.kind = kind;
    operator_->SetIdentity({"command", vehicle, kStart});
    operator_->Publish("COMMAND", m);
    Run(0.02);
  }

  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // where it stands, frame W
  int8_t health = pose_t::HEALTH_OK;
  int32_t n_cut = 0;       // of every list
  bool forecasts = false;  // prediction's process is well whether it sends any or not
  bus::Lockstep lockstep{kStart};
  std::vector<flight_state_t> states;
  std::vector<command_ack_t> acks;
  std::vector<health_t> healths;
  std::vector<geofence_t> fences;

 private:
  std::unique_ptr<bus::Bus> sensors_, operator_;
};

}  // namespace chase::mission
