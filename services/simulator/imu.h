#pragma once

#include <Eigen/Core>
#include <string>

#include "common/world/random.h"
#include "services/simulator/quadrotor.h"

namespace chase::simulator {

/// Errors of a small MEMS unit.
struct ImuConfig {
  double accel_noise = 0.02;
  double gyro_noise = 0.002;
  double accel_bias = 0.05;
  double gyro_bias = 0.003;
  double accel_walk = 0.001;
  double gyro_walk = 0.0001;

  template <class V>
  void Visit(V& v) {
    v("accel_noise", accel_noise, "standard deviation of a sample, m/s^2");
    v("gyro_noise", gyro_noise, "standard deviation of a sample, rad/s");
    v("accel_bias", accel_bias, "standard deviation at power-on, m/s^2");
    v("gyro_bias", gyro_bias, "standard deviation at power-on, rad/s");
    v("accel_walk", accel_walk, "bias random walk, m/s^2 per root s");
    v("gyro_walk", gyro_walk, "bias random walk, rad/s per root s");
  }
  std::string Problem() const;
};

struct ImuSample {
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, frame B, m/s^2
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< w_WB_B, rad/s
};

/// Accelerometer and gyroscope at the body's origin.
class Imu {
 public:
  Imu(const ImuConfig& config, uint64_t seed);
  /// A sample of the state, dt [s] after the one before.
  ImuSample Measure(const BodyState& state, double dt);
  const ImuSample& bias() const { return bias_; }

 private:
  Eigen::Vector3d Noise(double sigma);

  ImuConfig config_;
  world::Random random_;
  ImuSample bias_;
};

}  // namespace chase::simulator
