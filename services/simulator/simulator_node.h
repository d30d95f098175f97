#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/pose_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "services/simulator/hardware.h"
#include "services/simulator/sensor_faults.h"
#include "services/simulator/simulator.h"
#include "services/simulator/truth_feed.h"

namespace chase::simulator {

/// ATTITUDE_SETPOINT -> simulator -> IMU, LIDAR_SCAN, CAMERA_IMAGE, TRUTH, SCENARIO, FAULT,
/// FCU_STATUS. The first tick is power-on. Where the scenario's sensors.mode is "truth", also POSE,
/// TARGET and OBSTACLES. Else POSE is heard for the autopilot's estimator, as the bridge sends it.
/// Devices that `hardware` gives to drivers are neither heard nor published here.
class SimulatorNode : public bus::Node {
 public:
  SimulatorNode(bus::Bus& bus, const SimulatorConfig& config);

  int64_t TickPeriod() const override { return 5000; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  void Subscribe();
  void PublishSensors(Output* output, int64_t utime);
  void OnSetpoint(const attitude_setpoint_t& message);
  void OnPose(const pose_t& message);
  void PublishImu(const ImuSample& sample, int64_t utime);
  void PublishSweep(Sweep sweep);
  void PublishImage(Image image, int64_t utime);
  void PublishTruth(const Truth& truth, int64_t utime);
  void PublishScenario(int64_t utime);
  void PublishAutopilot(int64_t utime);
  void AdvanceFaults(int64_t utime);

  bus::Bus& bus_;
  SimulatorConfig config_;
  std::string yaml_;
  world::Scenario scenario_;
  Simulator simulator_;
  Hardware hardware_;
  SensorFaults faults_;
  std::unique_ptr<TruthFeed> truth_feed_;
  bus::Epoch epoch_;
  std::optional<int64_t> power_on_;  // utime of the first tick
  int64_t last_tick_ = 0;
  bool lands_ = false;  // as was told last
  int64_t ticks_ = 0;
};

}  // namespace chase::simulator
