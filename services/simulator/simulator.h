#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/world/rig.h"
#include "common/world/scenario.h"
#include "services/simulator/actors.h"
#include "services/simulator/attitude_loop.h"
#include "services/simulator/battery.h"
#include "services/simulator/camera.h"
#include "services/simulator/estimator.h"
#include "services/simulator/hardware_config.h"
#include "services/simulator/imu.h"
#include "services/simulator/lidar.h"
#include "services/simulator/quadrotor.h"
#include "services/simulator/scene.h"
#include "services/simulator/sensor_faults.h"
#include "services/simulator/wind.h"

namespace chase::simulator {

struct SimulatorConfig {
  std::string scenario = "deploy/scenarios/gym.yaml";
  int64_t seed = 1;
  std::string sensors;
  double setpoint_timeout = 0.5;
  world::Rig rig;
  VehicleConfig vehicle;
  BatteryConfig battery;
  AttitudeLoopConfig attitude_loop;
  ImuConfig imu;
  LidarConfig lidar;
  CameraConfig camera;
  HardwareConfig hardware;
  std::vector<world::FaultSpec> faults;

  template <class V>
  void Visit(V& v) {
    v("scenario", scenario, "file that describes the world");
    v("seed", seed, "of all noise and gusts");
    v("sensors", sensors, "raw or truth; empty: as the scenario says");
    v("setpoint_timeout", setpoint_timeout, "older setpoints give way to a landing, s");
    v("rig", rig, "where the sensors sit");
    v("vehicle", vehicle, "");
    v("battery", battery, "");
    v("attitude_loop", attitude_loop, "");
    v("imu", imu, "");
    v("lidar", lidar, "");
    v("camera", camera, "");
    v("hardware", hardware, "");
    v("faults", faults, "of the sensors; each with its time");
  }
  std::string Problem() const;
};

/// The truth at one time.
struct Truth {
  double mission_time = 0.0;  ///< s
  BodyState body;
  TargetState target;
  TargetView view;  ///< in the last frame
  std::vector<world::MoverState> movers;
};

/// What one step brings: a sample of the IMU always, a sweep or a frame when one is complete.
struct Output {
  ImuSample imu;
  Truth truth;
  std::optional<Sweep> sweep;
  std::vector<DataPacket> packets;  ///< of the LiDAR, where asked for
  std::optional<Image> image;
};

/// The world, the vehicle and its sensors. Time counts from power-on; the mission starts at
/// scenario.settle_s. The same seed, steps and setpoints give the same output, bit for bit.
class Simulator {
 public:
  Simulator(const world::Scenario& scenario, const SimulatorConfig& config);

  /// The flight controller's newest setpoint, in the frame of its estimator, received at t [s].
  void SetSetpoint(const AttitudeSetpoint& setpoint, double t);

  /// From the next step on.
  void Disturb(const Disturbance& disturbance);

  double charge() const { return battery_.charge(); }  ///< of the battery, 0 to 1

  const BodyState& body() const { return quadrotor_.state(); }
  /// True while a foot touches the ground.
  bool on_ground() const { return quadrotor_.on_ground(); }
  /// What the flight controller knows, but for what its IMU measures. It sinks level until its
  /// estimator is told of vision.
  Px4Body Known() const;
  Estimator& estimator() { return estimator_; }
  /// Does the flight controller land for want of setpoints?
  bool lands() const { return own_mode_ && setpoint_time_ >= 0.0; }

  /// Advances to t [s] at 1 kHz, and measures there. Times must grow; the first is 0.
  Output Advance(double t);

 private:
  std::vector<TimedPose> Fly(double t);
  Truth TruthNow() const;
  std::optional<Image> TakeFrame(const Truth& truth);
  void StepPhysics();
  void LearnHoverThrust();
  AttitudeSetpoint ActiveSetpoint();
  bool SetpointFresh() const;
  double now() const { return static_cast<double>(steps_) * 1e-3; }
  TimedPose Pose() const;

  world::Scenario scenario_;
  SimulatorConfig config_;
  Actors actors_;
  Scene scene_;
  Quadrotor quadrotor_;
  Battery battery_;
  AttitudeLoop attitude_loop_;
  Wind wind_;
  Imu imu_;
  Lidar lidar_;
  Camera camera_;
  long steps_ = 0;   // of physics, 1 ms each
  long frames_ = 0;  // of the camera
  double last_measurement_ = 0.0;
  Estimator estimator_;
  AttitudeSetpoint setpoint_;
  std::optional<OwnMode> own_mode_;                 // while setpoints are silent
  Eigen::Vector3d gust_ = Eigen::Vector3d::Zero();  // of a fault, m/s
  double setpoint_time_ = -1e9;
  double hover_thrust_ = kGravity;  // that the flight controller has learned, m/s^2
};

}  // namespace chase::simulator
