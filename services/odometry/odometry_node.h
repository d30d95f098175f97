#pragma once

#include <optional>

#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "common/bus/stamp_order.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

/// IMU and LIDAR_SCAN in; POSE at every IMU sample (without IMU: at every sweep) and
/// SCAN_REGISTERED out. Begins anew, in another frame, where the IMU's clock was set back, or the
/// LiDAR's while there is no IMU to tell the time, and where nothing came for so long that the
/// state is outdated.
class OdometryNode : public bus::Node {
 public:
  OdometryNode(bus::Bus& bus, const OdometryConfig& config);
  bus::NodeReport Report() const override;
  /// What the local map holds.
  size_t MapBytes() const { return odometry_->MapBytes(); }

 private:
  void OnImu(const imu_t& m);
  void OnScan(const lidar_scan_t& m);
  void BeginAnew();
  void ProcessSweeps();
  double SecondsOf(int64_t utime);
  void Publish(const PoseEstimate& estimate);
  void Publish(RegisteredSweep sweep);

  bus::Bus& bus_;
  OdometryConfig config_;
  std::optional<Odometry> odometry_;
  bus::StampOrder imu_order_, scan_order_;
  int64_t imu_at_sweep_ = bus::StampOrder().newest();  // the IMU's when the last sweep came
  bool has_origin_ = false;
  int64_t origin_ = 0;           // utime of t = 0
  int32_t first_epoch_, epoch_;  // of the odometry since the clock was last set back; the newest
  HealthReport health_;
};

}  // namespace chase::odometry
