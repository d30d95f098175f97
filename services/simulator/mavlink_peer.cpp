#include "services/simulator/mavlink_peer.h"

#include <fmt/format.h>

#include "common/math/rotation.h"
#include "common/mavlink/frames.h"

namespace chase::simulator {
namespace {

Px4Options OptionsOf(const SimulatorConfig& config) {
  Px4Options options;
  options.hover = kGravity / config.vehicle.max_thrust;
  options.starts_in_version_1 = false;  // MAV_PROTO_VER 2
  return options;
}

}  // namespace

MavlinkPeer::MavlinkPeer(const SimulatorConfig& config, int64_t utime)
    : px4_(OptionsOf(config), utime, static_cast<uint64_t>(config.seed)),
      socket_(config.hardware.host, config.hardware.fcu_port, config.hardware.fcu_own_port) {}

void MavlinkPeer::FollowVision(Estimator* estimator) {
  if (px4_.seen().odometry == poses_) return;
  poses_ = px4_.seen().odometry;
  const auto& m = *px4_.seen().vision;
  const auto utime = px4_.HostTime(m.time_usec);
  if (!utime) return;
  const Eigen::Quaterniond R_OB =
      mavlink::SwapFrames(Eigen::Quaterniond(m.q[0], m.q[1], m.q[2], m.q[3]));
  estimator->Correct({*utime, mavlink::SwapWorld({m.x, m.y, m.z}),
                      R_OB * mavlink::SwapBody({m.vx, m.vy, m.vz}), math::Yaw(R_OB),
                      m.reset_counter});
}

void MavlinkPeer::Steer(int64_t clock, double t, Simulator* simulator) {
  for (const Datagram& datagram : socket_.Take(clock)) {
    px4_.Receive(clock - datagram.age, clock, datagram.bytes);
    FollowVision(&simulator->estimator());
  }
  simulator->SetSetpoint(px4_.Demand(simulator->Known()), t);
}

void MavlinkPeer::Tell(int64_t utime, int64_t clock, const Simulator& simulator,
                       const ImuSample& imu) {
  Px4Body body = simulator.Known();
  body.accel = imu.accel;
  body.gyro = imu.gyro;
  px4_.Tick(utime, clock, body);
  for (const auto& bytes : px4_.TakeOutgoing()) socket_.Send(bytes.data(), bytes.size());
}

std::string MavlinkPeer::Words() const {
  return fmt::format("{}, {}, setpoints at most {:.0f} ms apart", px4_.mode().name(),
                     px4_.armed() ? "armed" : "disarmed", 1e3 * px4_.seen().longest_setpoint_gap);
}

}  // namespace chase::simulator
