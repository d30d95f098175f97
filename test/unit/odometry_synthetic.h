#pragma once

#include <functional>
#include <random>
#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry::test {

/// Seeded Gaussian noise.
class Noise {
 public:
  explicit Noise(unsigned seed) : generator_(seed) {}
  double Gauss(double sigma) { return sigma * normal_(generator_); }
  double Uniform() { return uniform_(generator_); }
  Eigen::Vector3d Vector(double sigma) { return {Gauss(sigma), Gauss(sigma), Gauss(sigma)}; }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

/// A room of flat walls, floor and ceiling with upright round pillars. Frame W, m.
struct Hall {
  Eigen::Vector3d min = {-4.0, -7.5, 0.0}, max = {4.0, 7.5, 4.0};
  struct Pillar {
    Eigen::Vector2d center;
    double radius = 0.28;
  };
  std::vector<Pillar> pillars = {{{-3.0, -3.0}}, {{3.0, -4.5}}, {{3.0, 1.0}}, {{-2.8, 2.5}},
                                 {{-3.2, 5.0}},  {{2.8, 5.5}},  {{-3.0, 0.0}}};
  bool ends_open =
      false;  ///< no walls at min.y and max.y, no pillars: nothing fixes motion along y

  /// Distance along the ray to the first surface, or infinity [m].
  double Cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;
};

/// An analytic flight: at rest until `rest` s, then sums of sines, blended in over two seconds.
struct Flight {
  double rest = 1.0;  ///< s
  Eigen::Vector3d start = {0.0, 0.0, 0.2};
  Eigen::Vector3d amplitude = {1.5, 4.0, 0.5};  ///< m
  Eigen::Vector3d rate = {0.45, 0.30, 0.5};     ///< rad/s
  double climb = 1.0;                           ///< height gained at the start of motion, m
  double yaw_amplitude = 1.2, yaw_rate = 0.25;  ///< rad, rad/s
  double tilt_amplitude = 0.08, tilt_rate = 2.0;
  Eigen::Vector3d slide = Eigen::Vector3d::Zero();  ///< from power-on, besides, m/s

  Pose X_WB(double t) const;
  Eigen::Vector3d Velocity(double t) const;
  static Flight AtRest();
  static Flight Aggressive();
};

struct SensorModel {
  double range_noise = 0.02;                      ///< m
  double gyro_noise = 0.003, accel_noise = 0.05;  ///< of a sample: rad/s, m/s^2
  Eigen::Vector3d gyro_bias = {0.004, -0.003, 0.002};
  Eigen::Vector3d accel_bias = {0.04, -0.03, 0.02};
  double dropout = 0.0;  ///< share of returns lost
  int azimuths = 1800;   ///< per ring
};

/// Sixteen rings of a VLP-16 seen from X_WB X_BL while both move.
Sweep Scan(const Hall& hall, const std::function<Pose(double)>& X_WL, double start,
           const SensorModel& model, Noise* noise);

ImuSample Measure(const Flight& flight, double t, const SensorModel& model, Noise* noise);

}  // namespace chase::odometry::test
