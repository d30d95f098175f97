#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "services/mission/mission.h"

namespace chase::mission {

inline constexpr double kTick = 0.1;  // s

/// A mission whose inputs are all well unless told otherwise.
class Bench {
 public:
  explicit Bench(const MissionConfig& config = {}, double start = 0.0) : mission(config, start) {
    pose.usable = pose.healthy = true;
    pose.epoch = 3;
    mission.inputs().battery = 1.0;
    HearSweeps(world::SweepRun::kEnough);
  }

  void Run(double seconds) {
    for (const double end = t + seconds - 1e-9; t < end;) {
      t += kTick;
      Hear();
      mission.Update(t);
    }
  }

  /// Good ones up to now, and none before.
  void HearSweeps(int n) {
    mission.inputs().sweeps = {};
    for (int i = n - 1; i >= 0; --i) mission.inputs().sweeps.Add(t - 0.1 * i, true);
  }

  world::CommandAnswer Command(Event kind, int64_t id = 0) {
    return mission.Obey(t, {{"command", 1, id != 0 ? id : ++last_id, t}, kind});
  }

  /// In the air at `p`, in HOLD.
  void Fly(const Eigen::Vector3d& p = {0.0, 0.0, 1.0}) {
    Run(0.2);
    ASSERT_TRUE(Command(Event::kTakeoff).accepted);
    pose.p = p;
    ASSERT_TRUE(Command(Event::kHold).accepted);
    Run(0.2);
  }

  Mission mission;
  PoseReport pose;
  bool hears_pose = true, hears_obstacles = true, hears_target = true, tracked = true;
  bool hears_prediction = true;
  bool hears_battery = true, hears_plans = true;  ///< the latter once it flies
  std::map<std::string, bool> failed = {
      {"prediction", false}, {"planning", false}, {"control", false}};
  double t = 10.0;
  int64_t last_id = 0;

 private:
  void Hear() {
    Inputs& in = mission.inputs();
    pose.t = t;
    if (hears_pose) in.pose = pose;
    if (hears_obstacles) in.obstacles = t;
    if (hears_target) in.target = t;
    if (hears_prediction) in.prediction = t;
    in.target_tracked = tracked;
    if (hears_battery) in.battery_heard = t;
    if (hears_plans && in.flying) in.plan_heard = t;
    for (const auto& [name, has_failed] : failed) {
      ProcessReport report;
      report.t = t;
      report.failed = has_failed;
      in.Heard(name, report);
    }
  }
};

}  // namespace chase::mission
