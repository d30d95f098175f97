#pragma once

#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

/// IMU and LIDAR_SCAN in; POSE at every IMU sample (without IMU: at every sweep) and
/// SCAN_REGISTERED out.
class OdometryNode : public bus::Node {
 public:
  OdometryNode(bus::Bus& bus, const OdometryConfig& config);
  bus::NodeReport Report() const override;
  /// What the local map holds.
  size_t MapBytes() const { return odometry_.MapBytes(); }

 private:
  void OnImu(const imu_t& m);
  void OnScan(const lidar_scan_t& m);
  void ProcessSweeps();
  double SecondsOf(int64_t utime);
  void Publish(const PoseEstimate& estimate);
  void Publish(RegisteredSweep sweep);

  bus::Bus& bus_;
  Odometry odometry_;
  bool has_origin_ = false;
  int64_t origin_ = 0;  // utime of t = 0
  HealthReport health_;
};

}  // namespace chase::odometry
