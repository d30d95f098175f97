#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "services/odometry/odometry_config.h"

namespace chase::odometry::trial {

/// What is flown, and what goes wrong on the way. Times count from power-on [s].
struct LiveOptions {
  std::string course = "follow";  ///< see courses.h
  int64_t seed = 1;
  double duration = 20.0;
  bool imu = true;
  double imu_from = 0.0;                            ///< s: sweeps come from the first moment on
  double lidar_out_from = 1e9, lidar_out_to = 1e9;  ///< no sweep begins in this time
  Eigen::Vector3d accel_fault = Eigen::Vector3d::Zero();  ///< of the IMU meanwhile, m/s^2
  /// For two seconds this share of bursts of one to `spike_length` samples reads `spike_size` times
  /// full scale (16 g, 2000 deg/s) on an axis.
  double spikes_from = 1e9, spikes_share = 0.02, spike_size = 1.0;
  int spike_length = 1;
  /// From then on so much is added to the biases along each axis, rad/s and m/s^2.
  double jump_from = 1e9, gyro_jump = 0.0, accel_jump = 0.0;
  /// For two seconds the LiDAR's stamps are off by `clock_step` s.
  double clock_from = 1e9, clock_step = 0.0;
  /// For two seconds the IMU's samples come `imu_delay` s late.
  double delay_from = 1e9, imu_delay = 0.3;
  double land_at = 1e9;  ///< the pilot falls silent: it sinks and stands
  double judge_from = 0.0;
};

/// How POSE did against the truth, at every estimate after the start. Without IMU W is the frame in
/// which the first sweep fits: errors count from the mean of the first second that is judged.
struct LiveFigures {
  int sweeps = 0;               ///< after the first
  int refused = 0;              ///< of these
  int lost = 0;                 ///< estimates that said so
  int degraded = 0;             ///< the same, from `judge_from` on
  int epochs = 0;               ///< restarts of the map
  double ate = 0.0;             ///< RMS of the position error in W, m
  double aligned = 0.0;         ///< the same after the best fit, m
  double worst = 0.0;           ///< m
  double end = 0.0;             ///< error at the end, m
  double moved = 0.0;           ///< how far the error went astray from `judge_from` on, m
  double turned = 0.0;          ///< largest error of the attitude, deg
  double worst_velocity = 0.0;  ///< largest error of the velocity, m/s
  /// From the LiDAR's return until the velocity is within 0.2 m/s, s; none: never.
  std::optional<double> velocity_back;
  /// Largest growth of the tilt's error since before the LiDAR was out while POSE says ok, deg;
  /// none: it never does.
  std::optional<double> tilt;
  double covered[3] = {0, 0, 0};  ///< share of estimates within three standard deviations, by axis
  double sigma[3] = {0, 0, 0};    ///< median standard deviation, by axis, m
  double rms[3] = {0, 0, 0};      ///< of the error, by axis, m
};

/// Flies a world with simulator and odometry in one process; a pilot who knows the truth flies.
LiveFigures FlyLive(const world::Scenario& scenario, const LiveOptions& options);

/// A meadow with `trees` trees on ground of the given roughness [m], laid out by `seed`.
world::Scenario Meadow(int trees, double roughness, uint64_t seed);

/// Two bare walls 12 m apart on even ground: nothing tells where along them one is, but for a few
/// posts half-way on if there are any.
world::Scenario BareStreet(bool posts);

/// Two walls far apart and four pillars on even ground, laid out by `seed`.
world::Scenario Square(uint64_t seed);

/// A corridor with doors to rooms on both sides, laid out by `seed`; it starts near one end.
world::Scenario Passage(uint64_t seed);

std::string Text(const LiveFigures& figures);

}  // namespace chase::odometry::trial
