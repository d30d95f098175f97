#include "services/simulator/attitude_loop.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

constexpr int kAttitudeDivider = 4;    // rate loop steps to one of the attitude loop
constexpr double kMaxIntegral = 5.0;   // rad/s^2
constexpr double kSlopeFilter = 0.15;  // share of a new sample; about 30 Hz at 1 kHz

Vector3d Clamped(const Vector3d& v, const Vector3d& limit) {
  return v.cwiseMin(limit).cwiseMax(-limit);
}

}  // namespace

std::string AttitudeLoopConfig::Problem() const {
  if (!(attitude_gain.minCoeff() > 0.0)) return "attitude_gain is not above 0 1/s";
  if (!(rate_gain.minCoeff() > 0.0)) return "rate_gain is not above 0 1/s";
  if (!(rate_integral.minCoeff() >= 0.0)) return "rate_integral is below 0 1/s^2";
  if (!(rate_derivative.minCoeff() >= 0.0)) return "rate_derivative is below 0";
  if (!(max_rate.minCoeff() > 0.0)) return "max_rate is not above 0 rad/s";
  return "";
}

void AttitudeLoop::Reset() { *this = AttitudeLoop(config_, inertia_); }

Vector3d AttitudeLoop::RateWanted(const AttitudeSetpoint& setpoint, const BodyState& state) const {
  const Eigen::Quaterniond error = state.q.conjugate() * setpoint.orientation.normalized();
  const Vector3d turn = 2.0 * (error.w() < 0.0 ? -1.0 : 1.0) * error.vec();
  return Clamped(config_.attitude_gain.cwiseProduct(turn) + error * setpoint.body_rate,
                 config_.max_rate);
}

Wrench AttitudeLoop::Step(const AttitudeSetpoint& setpoint, const BodyState& state, bool on_ground,
                          double dt) {
  if (steps_++ % kAttitudeDivider == 0) rate_wanted_ = RateWanted(setpoint, state);
  const Vector3d error = rate_wanted_ - state.w;
  slope_ += kSlopeFilter * ((state.w - last_rate_) / dt - slope_);
  last_rate_ = state.w;
  integral_ += dt * config_.rate_integral.cwiseProduct(error);
  integral_ =
      on_ground ? Vector3d(Vector3d::Zero()) : Clamped(integral_, Vector3d::Constant(kMaxIntegral));
  const Vector3d acceleration = config_.rate_gain.cwiseProduct(error) + integral_ -
                                config_.rate_derivative.cwiseProduct(slope_);
  return {setpoint.thrust,
          inertia_.cwiseProduct(acceleration) + state.w.cross(inertia_.cwiseProduct(state.w))};
}

}  // namespace chase::simulator
