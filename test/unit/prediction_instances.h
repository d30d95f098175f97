#pragma once

#include <Eigen/Geometry>
#include <random>

#include "services/prediction/predictor.h"

namespace chase::prediction {

/// Seeded problems: a target on a gentle curve, seen with noise, and ellipsoids ahead of it, half
/// of them moving.
class InstanceGenerator {
 public:
  explicit InstanceGenerator(uint64_t seed) : engine_(seed) {}

  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double Normal() {  // sum of uniforms: the same on every platform
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += Uniform(0.0, 1.0);
    return sum;
  }
  Eigen::Matrix3d Rotation() {
    return Eigen::Quaterniond(Normal(), Normal(), Normal(), Normal() + 1e-3)
        .normalized()
        .toRotationMatrix();
  }

  void set_all_moving(bool all_moving) { all_moving_ = all_moving; }

  PredictRequest Make(int n_observations, int n_obstacles, double nearest = 0.7) {
    PredictRequest request;
    const double speed = Uniform(0.6, 2.0), turn = Uniform(-0.5, 0.5), angle = Uniform(-3.1, 3.1);
    const Eigen::Vector3d origin(Uniform(-20, 20), Uniform(-20, 20), Uniform(0.3, 1.0));
    request.now = Uniform(0, 100);
    const Eigen::Matrix3d heading =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (int n = 0; n < n_observations; ++n) {
      const double t = -1.0 + static_cast<double>(n) / std::max(1, n_observations - 1);
      const Eigen::Matrix3d R = Rotation();
      const Eigen::Vector3d sigma(Uniform(0.03, 0.1), Uniform(0.03, 0.1), Uniform(0.03, 0.1));
      const Eigen::Vector3d noise =
          R * Eigen::Vector3d(sigma.x() * Normal(), sigma.y() * Normal(), sigma.z() * Normal());
      request.observations.push_back(
          {request.now + t,
           origin + heading * Eigen::Vector3d(speed * t, 0.5 * turn * t * t, 0) + noise,
           R * sigma.cwiseAbs2().asDiagonal() * R.transpose()});
    }
    for (int i = 0; i < n_obstacles; ++i) {
      world::Obstacle obstacle;
      obstacle.id = i;
      obstacle.moving = all_moving_ || i % 2 == 0;
      const Eigen::Matrix3d R = Rotation();
      const Eigen::Vector3d axes(Uniform(0.2, 0.5), Uniform(0.2, 0.5), Uniform(0.4, 1.2));
      obstacle.shape = R * axes.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
      const Eigen::Vector3d start =
          origin + heading * Eigen::Vector3d(Uniform(nearest, speed * 2.5 + 1), Uniform(-2, 2), 0);
      obstacle.center = world::Trajectory::Constant(start, request.now, 2.5);
      if (obstacle.moving) {
        obstacle.center.coefficients.conservativeResize(2, 3);
        obstacle.center.coefficients.row(1) << Uniform(-1.5, 1.5), Uniform(-1.5, 1.5), 0.0;
      }
      request.obstacles.push_back(obstacle);
    }
    return request;
  }

 private:
  std::mt19937_64 engine_;
  bool all_moving_ = false;
};

}  // namespace chase::prediction
