#include "services/control/controller.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::control {

namespace {

constexpr double kJumpBack = 1.0;  // s; less is jitter between publishers

bool Usable(const Estimate& e) {
  return e.p_WB.allFinite() && e.v_WB.allFinite() && e.R_WB.coeffs().allFinite() &&
         std::abs(e.R_WB.norm() - 1.0) < 1e-2;
}

bool Finite(const Reference& r) {
  const world::State& s = r.state;
  return s.p.allFinite() && s.v.allFinite() && s.a.allFinite() && s.j.allFinite() &&
         std::isfinite(r.yaw) && std::isfinite(r.yaw_rate);
}

bool Finite(const Setpoint& s) {
  return s.R_WB.coeffs().allFinite() && s.w_WB_B.allFinite() && std::isfinite(s.thrust);
}

}  // namespace

std::optional<Setpoint> Controller::Update(double t, const Estimate& estimate, Health health) {
  RestartIfTimeJumpedBack(t);
  const double dt = StepTo(t);
  plans_.Advance(t);
  position_error_ = 0.0;
  if (health != Health::kUsable || !Usable(estimate)) return Level();

  last_yaw_ = math::Yaw(estimate.R_WB);
  const std::optional<Reference> now = plans_.At(t);
  const std::optional<Reference> ahead = plans_.At(t + config_.lead);
  if (!now || !ahead) {
    mode_ = Mode::kIdle;
    return std::nullopt;
  }
  if (!Finite(*now) || !Finite(*ahead)) return Level();  // a plan of finite numbers may overflow
  const Setpoint setpoint = law_.Track(estimate, *now, *ahead, flying_ ? dt : 0.0);
  if (!Finite(setpoint)) return Level();
  flying_ = true;
  mode_ = overdue() > config_.slow_down ? Mode::kHolding : Mode::kTracking;
  position_error_ = (now->state.p - estimate.p_WB).norm();
  return setpoint;
}

std::optional<Setpoint> Controller::Level() {
  if (!flying_) return std::nullopt;
  mode_ = Mode::kLevel;
  return law_.LevelDescent(last_yaw_);
}

void Controller::RestartIfTimeJumpedBack(double t) {
  if (last_t_ && t < *last_t_ - kJumpBack) *this = Controller(config_);
}

double Controller::StepTo(double t) {
  const double dt = last_t_ ? std::max(0.0, t - *last_t_) : 0.0;
  last_t_ = std::max(t, last_t_.value_or(t));
  return dt;
}

}  // namespace chase::control
