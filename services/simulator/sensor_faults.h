#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/world/fault.h"
#include "common/world/random.h"
#include "services/simulator/camera.h"
#include "services/simulator/imu.h"

namespace chase::simulator {

/// What the flight's faults do to the world and to the vehicle.
struct Disturbance {
  Eigen::Vector3d gust = Eigen::Vector3d::Zero();    ///< added to the wind, frame W, m/s
  Eigen::Vector4d motors = Eigen::Vector4d::Ones();  ///< shares of the thrusts that they give
  bool target_hidden = false;
  bool decoy = false;
};

/// What the flight's faults do to the sensors and the vehicle. Times are mission time, s.
class SensorFaults {
 public:
  struct Change {
    std::string name;
    bool begins;
  };

  /// Each fault has its time; a negative duration is its kind's. Those that strike no sensor are
  /// left out. The gust's direction, the motor and the spikes are drawn from the flight's seed.
  explicit SensorFaults(const std::vector<world::FaultSpec>& faults, int64_t seed = 1);

  /// What begins or ends at `t` or since the last call; times must not fall.
  std::vector<Change> Advance(double t);

  /// No sweep leaves the LiDAR.
  bool LidarSilent() const { return Active(Effect::kSilenceLidar) != nullptr; }
  /// What the stamps of sweeps are off by, s.
  double LidarClock() const;
  Disturbance Disturbed() const;
  /// Spikes of full scale and a step of the bias, in units of a unit like `config`.
  void Strike(const ImuConfig& config, ImuSample* sample);
  void Strike(Image* image) const;

 private:
  using Effect = world::FaultKind::Effect;
  struct Entry {
    world::FaultSpec fault;
    const world::FaultKind* kind;
    bool active = false;
  };
  const world::FaultKind* Active(Effect effect) const;  // or null

  std::vector<Entry> entries_;
  world::Random random_;
  Eigen::Vector3d gust_direction_;
  int motor_;
};

}  // namespace chase::simulator
