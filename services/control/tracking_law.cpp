#include "services/control/tracking_law.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::control {

namespace {

using Eigen::Vector3d;

constexpr double kTrimTime = 5.0;      // s that the trim averages over
constexpr double kMostWind = 1.0;      // m/s^2: 4 m/s, drag 0.25 1/s
constexpr double kAirborne = 0.3;      // m/s: no body stands at that
constexpr double kLiftOff = 3.0;       // s of following plans: by then it hovers
constexpr double kLongestStep = 0.05;  // s; a gap in the estimates must not wind the integral up

Vector3d Shortened(const Vector3d& v, double limit) {
  const double norm = v.norm();
  return norm > limit ? Vector3d(v * (limit / norm)) : v;
}

Vector3d Clamped(const Vector3d& v, double limit) { return v.cwiseMax(-limit).cwiseMin(limit); }

}  // namespace

Vector3d LimitThrust(const Vector3d& thrust, const ControlConfig& config) {
  const double vertical = std::clamp(thrust.z(), config.min_thrust, config.max_thrust);
  const double by_tilt = vertical * std::tan(config.tilt_limit_deg * M_PI / 180.0);
  const double by_power = std::sqrt(config.max_thrust * config.max_thrust - vertical * vertical);
  const Vector3d horizontal = Shortened({thrust.x(), thrust.y(), 0.0}, std::min(by_tilt, by_power));
  return horizontal + vertical * Vector3d::UnitZ();
}

Setpoint AttitudeFor(const Vector3d& thrust, const Vector3d& thrust_rate, double yaw,
                     double yaw_rate) {
  const Vector3d heading(std::cos(yaw), std::sin(yaw), 0.0);
  const Vector3d heading_rate = yaw_rate * Vector3d(-heading.y(), heading.x(), 0.0);
  const double norm = thrust.norm();
  const Vector3d z = thrust / norm;
  const Vector3d z_rate = (thrust_rate - z * z.dot(thrust_rate)) / norm;
  const Vector3d side = z.cross(heading);
  const Vector3d y = side.normalized();
  const Vector3d x = y.cross(z);
  const Vector3d side_rate = z_rate.cross(heading) + z.cross(heading_rate);

  Setpoint result;
  Eigen::Matrix3d R;
  R << x, y, z;
  result.R_WB = Eigen::Quaterniond(R).normalized();
  // From dR/dt = R [w]x: dz/dt = w_y x - w_x y and dy/dt . x = -w_z.
  result.w_WB_B = {-y.dot(z_rate), x.dot(z_rate), -x.dot(side_rate) / side.norm()};
  result.thrust = norm;
  return result;
}

Setpoint TrackingLaw::Track(const Estimate& estimate, const Reference& now, const Reference& ahead,
                            double dt) {
  Learn(estimate, dt);
  const Vector3d drag(drag_.value(), drag_.value(), config_.drag.z());
  const Vector3d before = integral_;
  Integrate(now.state.p - estimate.p_WB, dt);
  const Vector3d feed_forward =
      ahead.state.a + drag.cwiseProduct(now.state.v) + kGravity * Vector3d::UnitZ();
  const Vector3d wanted = feed_forward + Feedback(estimate, now.state) + integral_;
  const Vector3d thrust = LimitThrust(wanted, config_);
  // Anti-windup: what the limits cut off is not asked for more of (conditional integration).
  const Vector3d cut = wanted - thrust;
  for (int i = 0; i < 3; ++i)
    if (cut[i] * (integral_[i] - before[i]) > 0.0) integral_[i] = before[i];
  const Vector3d thrust_rate = ahead.state.j + drag.cwiseProduct(ahead.state.a);

  const double yaw = math::Yaw(estimate.R_WB);
  const double turn =
      std::clamp(math::WrapAngle(ahead.yaw - yaw), -config_.max_yaw_error, config_.max_yaw_error);
  Setpoint result = AttitudeFor(thrust, thrust_rate, yaw + turn, ahead.yaw_rate);
  result.w_WB_B = Clamped(result.w_WB_B, config_.max_body_rate);
  result.thrust = asked_ = AlongBody(thrust, estimate);
  return result;
}

Setpoint TrackingLaw::Brake(const Estimate& estimate, double yaw) const {
  return Sink(estimate, yaw, trim_.z() - config_.velocity_gain.z() * estimate.v_WB.z());
}

Setpoint TrackingLaw::Sink(const Estimate& estimate, double yaw, double lift) const {
  Vector3d wanted = trim_ - config_.velocity_gain.cwiseProduct(estimate.v_WB);
  wanted.z() = kGravity + lift;
  const Vector3d thrust = LimitThrust(wanted, config_);
  Setpoint result = AttitudeFor(thrust, Vector3d::Zero(), yaw, 0.0);
  result.thrust = AlongBody(thrust, estimate);
  return result;
}

Setpoint TrackingLaw::Level(double yaw, double lift) const {
  Setpoint result = AttitudeFor(Vector3d::UnitZ(), Vector3d::Zero(), yaw, 0.0);
  result.thrust = Asked(kGravity + lift);
  return result;
}

void TrackingLaw::Turn(double yaw) {
  integral_ = math::FromYaw(yaw) * integral_;
  trim_ = math::FromYaw(yaw) * trim_;
  drag_.Turn(yaw);
}

double TrackingLaw::Asked(double thrust) const {
  return std::clamp(thrust / thrust_gain(), config_.min_thrust, config_.max_thrust);
}

// Lee 2010, eq. (15): only the part along the body's present z axis acts as wanted.
double TrackingLaw::AlongBody(const Vector3d& thrust, const Estimate& estimate) const {
  return Asked(thrust.dot(estimate.R_WB * Vector3d::UnitZ()));
}

// The velocity error includes the speed that closes the position error, so that the sum is Lee's
// kp e_p + kv e_v near the reference and a bounded approach speed far from it.
Vector3d TrackingLaw::Feedback(const Estimate& estimate, const world::State& reference) const {
  const Vector3d approach = (reference.p - estimate.p_WB)
                                .cwiseProduct(config_.position_gain)
                                .cwiseQuotient(config_.velocity_gain);
  const Vector3d velocity_error =
      reference.v + Shortened(approach, config_.catch_up_speed) - estimate.v_WB;
  return config_.velocity_gain.cwiseProduct(velocity_error);
}

void TrackingLaw::Learn(const Estimate& estimate, double dt) {
  followed_ += dt;
  airborne_ = airborne_ || estimate.v_WB.norm() > kAirborne || followed_ > kLiftOff;
  if (!airborne_) return;
  const double step = std::min(dt, kLongestStep);
  const Eigen::Matrix3d R_WB = estimate.R_WB.toRotationMatrix();
  const Vector3d felt = estimate.a_WB + kGravity * Vector3d::UnitZ();
  drag_.Add(R_WB.transpose() * felt, estimate.v_WB, R_WB, step);
  Weigh(felt + config_.drag.cwiseProduct(estimate.v_WB), estimate, step);
}

// What the gain learns the integral need not ask for any more: what is asked for does not jump.
void TrackingLaw::Weigh(const Vector3d& force, const Estimate& estimate, double dt) {
  const double before = thrust_gain();
  gain_.Add(asked_, force.dot(estimate.R_WB * Vector3d::UnitZ()), dt);
  const double bears = (kGravity + integral_.z()) * thrust_gain() / before - kGravity;
  integral_.z() = std::clamp(bears, -config_.integral_limit, config_.integral_limit);
}

// A large error is a manoeuvre, not a bias: it is left to the feedback.
void TrackingLaw::Integrate(const Vector3d& position_error, double dt) {
  const double step = std::clamp(dt, 0.0, kLongestStep);
  for (int i = 0; i < 3; ++i) {
    const double approach =
        std::abs(position_error[i]) * config_.position_gain[i] / config_.velocity_gain[i];
    if (approach > config_.catch_up_speed) continue;
    integral_[i] = std::clamp(integral_[i] + config_.integral_gain[i] * position_error[i] * step,
                              -config_.integral_limit, config_.integral_limit);
  }
  const Vector3d horizontal(integral_.x(), integral_.y(), 0.0);
  trim_ += step / kTrimTime * (Shortened(horizontal, kMostWind) - trim_);
}

}  // namespace chase::control
