#include "services/odometry/odometry_node.h"

#include <utility>

#include "chase/pose_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "common/bus/convert.h"

namespace chase::odometry {

namespace {

Sweep FromMessage(const lidar_scan_t& m, double start) {
  Sweep sweep;
  sweep.start = start;
  sweep.points.resize(static_cast<size_t>(m.size));
  for (size_t i = 0; i < sweep.points.size(); ++i)
    sweep.points[i] = {{m.x[i], m.y[i], m.z[i]}, m.t[i], m.intensity[i], m.ring[i]};
  return sweep;
}

constexpr double kMostVariance = 1e6;  // m^2, m^2/s^2, rad^2

// Another life of the process works in another frame: the number begins with when it began, tenths
// of a second.
int32_t FirstEpoch(int64_t start) { return static_cast<int32_t>(start / 100000 % 1000000) * 1000; }

pose_t ToMessage(const PoseEstimate& estimate, int64_t origin) {
  pose_t m{};
  m.utime = bus::Utime(estimate.t, origin);
  bus::Set(m.pos, estimate.X_WB.p);
  bus::Set(m.vel, estimate.v);
  bus::Set(m.orientation, estimate.X_WB.R);
  bus::Set(m.rotation_rate, estimate.w_B);
  bus::Set(m.accel, estimate.a);
  bus::Set(m.gyro_bias, estimate.gyro_bias);
  bus::Set(m.accel_bias, estimate.accel_bias);
  // A lost filter's covariance grows without bound; the bus refuses numbers from 1e7 on.
  using Wire = Eigen::Map<Eigen::Matrix<double, 9, 9, Eigen::RowMajor>>;
  Wire(m.covariance) = estimate.covariance.cwiseMax(-kMostVariance).cwiseMin(kMostVariance);
  Wire(m.local_covariance) =
      estimate.local_covariance.cwiseMax(-kMostVariance).cwiseMin(kMostVariance);
  m.epoch = estimate.epoch;
  m.health = static_cast<int8_t>(estimate.health.health);
  m.correcting = estimate.correcting ? 1 : 0;
  m.reason = estimate.health.reason;
  return m;
}

scan_registered_t ToMessage(RegisteredSweep sweep, int64_t origin) {
  scan_registered_t m{};
  m.utime = bus::Utime(sweep.t, origin);
  bus::Set(m.pos, sweep.X_WL.p);
  bus::Set(m.orientation, sweep.X_WL.R);
  m.epoch = sweep.epoch;
  m.health = static_cast<int8_t>(sweep.health);
  m.size = static_cast<int32_t>(sweep.x.size());
  m.x = std::move(sweep.x), m.y = std::move(sweep.y), m.z = std::move(sweep.z);
  m.intensity = std::move(sweep.intensity), m.ring = std::move(sweep.ring);
  return m;
}

}  // namespace

OdometryNode::OdometryNode(bus::Bus& bus, const OdometryConfig& config)
    : bus_(bus),
      config_(config),
      odometry_(config),
      first_epoch_(FirstEpoch(bus.identity().start)),
      epoch_(first_epoch_) {
  bus_.Subscribe<imu_t>("IMU", [this](const imu_t& m) { OnImu(m); });
  bus_.Subscribe<lidar_scan_t>("LIDAR_SCAN", [this](const lidar_scan_t& m) { OnScan(m); });
}

double OdometryNode::SecondsOf(int64_t utime) {
  if (!has_origin_) origin_ = utime;
  has_origin_ = true;
  return bus::Seconds(utime, origin_);
}

void OdometryNode::BeginAnew() {
  first_epoch_ = epoch_ + 1;
  has_origin_ = false;
  // A body that flew when its sensors fell silent flies: it is not waited for to settle.
  OdometryConfig config = config_;
  if (odometry_->Flies()) config.alignment.patience = 0.0;
  odometry_.emplace(config);
}

void OdometryNode::OnImu(const imu_t& m) {
  if (imu_order_.Take(m.utime) == bus::StampOrder::Verdict::kSetBack) {
    BeginAnew();
    scan_order_ = {};
  }
  if (odometry_->Outdated(SecondsOf(m.utime))) BeginAnew();
  std::optional<PoseEstimate> pose;
  {
    const auto timer = bus_.Time("imu");
    pose = odometry_->AddImu({SecondsOf(m.utime), bus::ToVector(m.accel), bus::ToVector(m.gyro)});
  }
  if (pose) Publish(*pose);
  ProcessSweeps();
}

void OdometryNode::OnScan(const lidar_scan_t& m) {
  const bool silent = imu_order_.newest() == imu_at_sweep_;  // since the last sweep
  if (scan_order_.Take(m.utime) == bus::StampOrder::Verdict::kSetBack && silent) {
    BeginAnew();
    imu_order_ = {};
  }
  imu_at_sweep_ = imu_order_.newest();
  odometry_->AddSweep(FromMessage(m, SecondsOf(m.utime)));
  ProcessSweeps();
}

void OdometryNode::ProcessSweeps() {
  while (odometry_->SweepReady()) {
    SweepResult result;
    {
      const auto timer = bus_.Time("sweep");
      result = odometry_->ProcessSweep();
    }
    if (result.pose) Publish(*result.pose);
    if (result.registered) Publish(std::move(*result.registered));
  }
}

void OdometryNode::Publish(const PoseEstimate& estimate) {
  health_ = estimate.health;
  pose_t m = ToMessage(estimate, origin_);
  m.epoch += first_epoch_;
  epoch_ = m.epoch;
  bus_.Publish("POSE", m);
}

void OdometryNode::Publish(RegisteredSweep sweep) {
  scan_registered_t m = ToMessage(std::move(sweep), origin_);
  m.epoch += first_epoch_;
  epoch_ = m.epoch;
  bus_.Publish("SCAN_REGISTERED", std::move(m));
}

bus::NodeReport OdometryNode::Report() const {
  using State = bus::NodeReport::State;
  switch (health_.health) {
    case Health::kOk:
      return {State::kOk, ""};
    case Health::kDegraded:
      return {State::kDegraded, health_.reason};
    case Health::kLost:
      return {State::kFailed, health_.reason};
    case Health::kStarting:
      break;
  }
  return {State::kStarting, health_.reason};
}

}  // namespace chase::odometry
