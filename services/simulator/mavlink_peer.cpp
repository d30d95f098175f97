#include "services/simulator/mavlink_peer.h"

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

void MavlinkPeer::FollowVision() {
  if (px4_.seen().odometry == poses_) return;
  poses_ = px4_.seen().odometry;
  const auto& m = *px4_.seen().vision;
  const auto utime = px4_.HostTime(m.time_usec);
  if (!utime) return;
  const Eigen::Quaterniond q(m.q[0], m.q[1], m.q[2], m.q[3]);
  frame_.AddVision(*utime, mavlink::SwapWorld({m.x, m.y, m.z}), math::Yaw(mavlink::SwapFrames(q)),
                   m.reset_counter);
}

void MavlinkPeer::Steer(int64_t clock, double t, Simulator* simulator) {
  for (const auto& bytes : socket_.Take(clock)) {
    px4_.Receive(clock, bytes);
    FollowVision();
  }
  Px4Body body = frame_.InVision(simulator->body());
  body.touches = simulator->on_ground();
  body.hover_thrust = simulator->hover_thrust();
  const Px4Demand demand = px4_.Demand(body);
  AttitudeSetpoint setpoint;
  setpoint.motors = demand.motors;
  setpoint.orientation = frame_.InWorld(demand.R_WB);
  setpoint.body_rate = demand.rate;
  setpoint.thrust = demand.thrust;
  simulator->SetSetpoint(setpoint, t);
}

void MavlinkPeer::Tell(int64_t utime, int64_t clock, const Simulator& simulator,
                       const ImuSample& imu) {
  frame_.AddTruth(utime, simulator.body());
  Px4Body body = frame_.InVision(simulator.body());
  body.accel = imu.accel;
  body.gyro = imu.gyro;
  body.touches = simulator.on_ground();
  body.thrust = simulator.thrust();
  body.charge = simulator.charge();
  px4_.Tick(utime, clock, body);
  for (const auto& bytes : px4_.TakeOutgoing()) socket_.Send(bytes.data(), bytes.size());
}

std::string MavlinkPeer::Words() const {
  return px4_.mode().name() + (px4_.armed() ? ", armed" : ", disarmed");
}

}  // namespace chase::simulator
