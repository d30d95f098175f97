#include "services/simulator/imu.h"

#include <algorithm>
#include <cmath>

#include "services/simulator/streams.h"

namespace chase::simulator {

std::string ImuConfig::Problem() const {
  const double least =
      std::min({accel_noise, gyro_noise, accel_bias, gyro_bias, accel_walk, gyro_walk});
  return least >= 0.0 ? "" : "a standard deviation is below 0";
}

Imu::Imu(const ImuConfig& config, uint64_t seed) : config_(config), random_(seed, kImuStream) {
  bias_.accel = Noise(config_.accel_bias);
  bias_.gyro = Noise(config_.gyro_bias);
}

Eigen::Vector3d Imu::Noise(double sigma) {
  const double x = random_.Gaussian(), y = random_.Gaussian(), z = random_.Gaussian();
  return sigma * Eigen::Vector3d(x, y, z);
}

ImuSample Imu::Measure(const BodyState& state, double dt) {
  bias_.accel += Noise(config_.accel_walk * std::sqrt(dt));
  bias_.gyro += Noise(config_.gyro_walk * std::sqrt(dt));
  const Eigen::Vector3d force_W = state.a + Eigen::Vector3d(0.0, 0.0, kGravity);
  ImuSample sample;
  sample.accel = state.q.conjugate() * force_W + bias_.accel + Noise(config_.accel_noise);
  sample.gyro = state.w + bias_.gyro + Noise(config_.gyro_noise);
  return sample;
}

}  // namespace chase::simulator
