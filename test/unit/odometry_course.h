#pragma once

#include <functional>
#include <vector>

#include "services/odometry/odometry.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry::test {

/// A synthetic flight fed to the odometry as a bus would deliver it.
struct Course {
  Hall hall;
  Flight flight;
  SensorModel sensors;
  double duration = 20.0;                         ///< s
  double corridor_from = 1e9, corridor_to = 1e9;  ///< the hall has no ends in this time, s
  unsigned seed = 1;
  Eigen::Vector3d mount_error = Eigen::Vector3d::Zero();  ///< turns the LiDAR in B, rad
  /// May change or remove (by returning false) what the sensors give.
  std::function<bool(Sweep*)> on_sweep;
  std::function<bool(ImuSample*)> on_imu;
};

/// One pose as put out, and how far it is from the truth.
struct Visit {
  PoseEstimate estimate;
  double position_error = 0.0;  ///< m
  double velocity_error = 0.0;  ///< m/s
  double yaw_error = 0.0;       ///< rad
};

struct CourseResult {
  std::vector<Visit> visits;
  std::vector<RegisteredSweep> sweeps;
  double sweep_cpu_ms = 0.0;  ///< mean per sweep
  double worst_sweep_ms = 0.0;

  double PositionRms(double from = 0.0) const;
  double VelocityRms(double from = 0.0) const;
  double WorstPosition(double from = 0.0, double to = 1e9) const;
  /// Largest change of (position - true position) from a pose to the next [m].
  double WorstJump() const;
  /// First time at or after `from` at which the health is (or is not) OK; infinity if never.
  double FirstTime(double from, bool ok) const;
  bool Finite() const;
};

CourseResult Fly(const Course& course, const OdometryConfig& config);

/// The default configuration at the flight's start.
OdometryConfig ConfigFor(const Flight& flight);

}  // namespace chase::odometry::test
