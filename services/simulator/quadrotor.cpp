#include "services/simulator/quadrotor.h"

#include <algorithm>
#include <cmath>

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kLegStiffness = 3000.0;  // N/m a foot
constexpr double kLegDamping = 60.0;      // N s/m a foot
constexpr double kFriction = 0.8;         // tangential over normal force
constexpr double kFrictionSlope = 200.0;  // N s/m a foot, below the limit of friction

// Signs of x, y and of the yaw torque per motor.
const Vector4d kFront(1.0, -1.0, 1.0, -1.0);
const Vector4d kLeft(1.0, -1.0, -1.0, 1.0);
const Vector4d kSpin(-1.0, -1.0, 1.0, 1.0);

/// The largest share s <= 1 such that base + s * change stays within [0, limit].
double ShareWithin(const Vector4d& base, const Vector4d& change, double limit) {
  double share = 1.0;
  for (int i = 0; i < 4; ++i) {
    const double room = change[i] > 0.0 ? limit - base[i] : base[i];
    if (std::abs(change[i]) * share > room) share = std::max(0.0, room) / std::abs(change[i]);
  }
  return share;
}

/// What motors on a bent curve give of the thrusts asked for [N].
Vector4d TrueThrusts(const VehicleConfig& config, const Vector4d& asked) {
  if (config.thrust_curve == 0.0) return asked;
  const Vector4d share = asked / (config.mass * config.max_thrust / 4.0);
  return asked.array() * (1.0 - config.thrust_curve + config.thrust_curve * share.array());
}

Eigen::Quaterniond Turned(const Eigen::Quaterniond& q, const Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-12) return q;
  return (q * Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle))).normalized();
}

}  // namespace

std::string VehicleConfig::Problem() const {
  if (!(mass > 0.0)) return "mass is not above 0 kg";
  if (!(inertia.minCoeff() > 0.0)) return "inertia is not above 0 kg m^2";
  if (!(arm > 0.0)) return "arm is not above 0 m";
  if (!(torque_ratio > 0.0)) return "torque_ratio is not above 0 m";
  if (!(motor_lag >= 0.002)) return "motor_lag is below 0.002 s, two steps of the simulation";
  if (!(max_thrust > kGravity)) return "max_thrust is not above gravity, 9.81 m/s^2";
  if (!(std::abs(thrust_error) < 0.5)) return "thrust_error is not within -0.5 to 0.5";
  if (!(std::abs(thrust_curve) < 0.5)) return "thrust_curve is not within -0.5 to 0.5";
  if (!(std::abs(mass_error) < 0.5)) return "mass_error is not within -0.5 to 0.5";
  if (!(drag.minCoeff() >= 0.0)) return "drag is below 0 1/s";
  if (!(leg_height > 0.0 && leg_spread > 0.0)) return "leg_height or leg_spread is not above 0 m";
  return "";
}

double StandingHeight(const VehicleConfig& config) {
  return config.leg_height - config.TrueMass() * kGravity / (4.0 * kLegStiffness);
}

Quadrotor::Quadrotor(const VehicleConfig& config, const BodyState& start, Ground ground)
    : config_(config), state_(start), ground_(std::move(ground)) {}

/// Roll and pitch before yaw; what exceeds the motors is scaled down, the collective is kept.
Vector4d Quadrotor::Mix(const Wrench& wanted) const {
  const double limit = config_.mass * config_.max_thrust / 4.0;
  const double lever = config_.arm * std::sqrt(8.0);  // 4 x the distance from the axis
  const Vector4d base =
      Vector4d::Constant(std::clamp(config_.mass * wanted.thrust / 4.0, 0.0, limit));
  const Vector4d tilt = (kLeft * wanted.torque.x() - kFront * wanted.torque.y()) / lever;
  const Vector4d level = base + ShareWithin(base, tilt, limit) * tilt;
  const Vector4d yaw = kSpin * wanted.torque.z() / (4.0 * config_.torque_ratio);
  return level + ShareWithin(level, yaw, limit) * yaw;
}

Quadrotor::Load Quadrotor::MotorLoad() const {
  const Vector4d healthy = (1.0 + config_.thrust_error) * TrueThrusts(config_, motors_);
  const Vector4d f = supply_ * healthy.cwiseProduct(motor_shares_);
  const double distance = config_.arm / std::sqrt(2.0);
  return {state_.q * Vector3d(0.0, 0.0, f.sum()),
          Vector3d(distance * kLeft.dot(f), -distance * kFront.dot(f),
                   config_.torque_ratio * kSpin.dot(f))};
}

void Quadrotor::AddLegs(Load* load) {
  on_ground_ = false;
  const Eigen::Matrix3d R_WB = state_.q.toRotationMatrix();
  for (int i = 0; i < 4; ++i) {
    const Vector3d foot(config_.leg_spread * kFront[i], config_.leg_spread * kLeft[i],
                        -config_.leg_height);
    const Vector3d p = state_.p + R_WB * foot, v = state_.v + R_WB * state_.w.cross(foot);
    const double depth = ground_(p.x(), p.y()) - p.z();
    if (depth <= 0.0) continue;
    on_ground_ = true;
    const double normal = std::max(0.0, kLegStiffness * depth - kLegDamping * v.z());
    const double speed = v.head<2>().norm();
    const double slope = std::min(kFrictionSlope, kFriction * normal / std::max(speed, 1e-9));
    const Vector3d force(-slope * v.x(), -slope * v.y(), normal);
    load->force += force;
    load->torque += foot.cross(R_WB.transpose() * force);
  }
}

/// Velocity Verlet for the translation, midpoint for the rotation.
void Quadrotor::Step(const Wrench& wanted, const Vector3d& wind, double dt) {
  motors_ += (1.0 - std::exp(-dt / config_.motor_lag)) * (Mix(wanted) - motors_);
  Load load = MotorLoad();
  const Vector3d air_B = state_.q.conjugate() * (state_.v - wind);
  const double mass = config_.TrueMass();
  load.force -= mass * (state_.q * config_.drag.cwiseProduct(air_B));
  AddLegs(&load);
  state_.a = load.force / mass - Vector3d(0.0, 0.0, kGravity);
  state_.p += dt * state_.v + 0.5 * dt * dt * state_.a;
  state_.v += dt * state_.a;
  const Vector3d spin = state_.w.cross(config_.inertia.cwiseProduct(state_.w));
  const Vector3d w_dot = (load.torque - spin).cwiseQuotient(config_.inertia);
  state_.q = Turned(state_.q, dt * (state_.w + 0.5 * dt * w_dot));
  state_.w += dt * w_dot;
}

}  // namespace chase::simulator
