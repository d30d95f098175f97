#include "services/control/controller.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"
#include "common/world/ages.h"

namespace chase::control {

namespace {

constexpr double kSame = 0.01;   // m: planning takes the start from the plan that is flown
constexpr double kAtRest = 0.3;  // m/s: gusts about a wind of 3 m/s stir a hovering body by less
constexpr double kAtEnd = 0.3;   // m: planning asks for as much free ground beside the body
constexpr double kLongestWay = 45.0;  // s to above the ground that planning chose, at 2.2 s a metre
constexpr double kBraking = 2.0;      // s to rest after that; from 3 m/s it takes half of it
// m/s: POSE of the sentinels has 0.03, and a second without sweeps adds filter.doubt_accel's 0.1.
constexpr double kMeasured = 0.1;

bool Usable(const Estimate& e) {
  return e.p_WB.allFinite() && e.v_WB.allFinite() && e.a_WB.allFinite() &&
         e.R_WB.coeffs().allFinite() && std::abs(e.R_WB.norm() - 1.0) < 1e-2;
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

std::string Controller::AddPlan(const Plan& plan) {
  if (last_t_ && *last_t_ > StopsAt(plan)) return "it comes after its time";
  if (flying_ && !IsNear(plan)) return "it is where neither the reference nor the body is";
  return plans_.Add(plan) ? "" : "it starts before the one being flown, or is empty";
}

// The reference may be far from the body, which follows it; a new plan does not add to that. A
// certified plan is proven for a body in its tube; one that goes on along the reference adds
// nothing.
bool Controller::IsNear(const Plan& plan) const {
  const double start = plan.position.start, now = last_t_.value_or(start);
  const double t = std::max(start, now);  // from when on it would be flown
  const Eigen::Vector3d p = Sample(plan, t).state.p;
  const std::optional<Reference> reference = plans_.At(t);
  const double from_reference = plan.tube ? kSame : config_.reset_distance;
  if (reference && (reference->state.p - p).norm() <= from_reference) return true;
  const double ahead = std::min(t - now, 0.2);
  return (last_estimate_.p_WB + ahead * last_estimate_.v_WB - p).norm() <=
         std::min(plan.tube.value_or(HUGE_VAL), config_.reset_distance);
}

std::optional<Setpoint> Controller::Update(double t, const Estimate& estimate, Health health) {
  FollowTimeBack(t);
  const double dt = StepTo(t);
  plans_.Advance(t);
  error_.setZero();
  if (cut_) return Off();
  return Sent(t, Answer(t, estimate, health, dt));
}

// What is sent is what the body does until it is told otherwise.
std::optional<Setpoint> Controller::Sent(double t, std::optional<Setpoint> setpoint) {
  if (setpoint) reckoning_.Ask(t, *setpoint, law_.thrust_gain(), law_.trim());
  return setpoint;
}

std::optional<Setpoint> Controller::Answer(double t, const Estimate& estimate, Health health,
                                           double dt) {
  if (landing_.is_down()) health = Health::kLost;  // motors that are off stay off
  const bool finite = Usable(estimate);
  if (health != Health::kUsable || !finite)
    return WithoutPose(t, estimate, finite ? health : Health::kStarting, dt);
  last_usable_ = t;
  if (estimate.velocity_sigma <= kMeasured) last_measured_ = t;
  last_estimate_ = estimate;
  reckoning_.Begin(t, estimate);
  last_yaw_ = math::Yaw(estimate.R_WB);
  if (!spot_) landing_ = Landing(config_);
  if (Waits(t)) return Idle();
  if (!flying_ && !may_begin_) return std::nullopt;
  return Follow(t, estimate, dt);
}

void Controller::SetLanding(bool wanted) {
  if (lands_ && !wanted && !is_down()) {
    spot_.reset();
    landing_ = Landing(config_);
  }
  if (wanted && !lands_) asked_to_land_ = last_t_.value_or(0.0);
  lands_ = wanted;
}

std::optional<Setpoint> Controller::Follow(double t, const Estimate& estimate, double dt) {
  if (const std::optional<Setpoint> setpoint = Descend(t, estimate, dt)) return setpoint;
  const std::optional<Reference> now = plans_.At(t);
  const std::optional<Reference> ahead = plans_.At(t + config_.lead);
  if (!now || !ahead || !Finite(*now) || !Finite(*ahead)) return Brake(estimate);
  const Eigen::Vector3d error = now->state.p - estimate.p_WB;
  // A body that drifted far while it was lost waits for a plan that starts where it is.
  if (lost_ && error.norm() > config_.reset_distance) {
    plans_.Clear();
    return Brake(estimate);
  }
  const Setpoint setpoint = law_.Track(estimate, *now, *ahead, flying_ && obeys_ ? dt : 0.0);
  if (!Finite(setpoint)) return Brake(estimate);
  flying_ = true;
  lost_ = false;
  const Plan& plan = *plans_.FlownAt(t);
  overdue_ = t - StopsAt(plan);
  plan_seq_ = plan.seq;
  following_ = overdue_ > 0.0 ? Following::kStop : Following::kPlan;
  error_ = error;
  bound_.Add(t, error.norm());
  return setpoint;
}

// Planning leads to above the ground that it chooses; whoever is not led, or does not get there,
// comes down here.
bool Controller::MayDescend(double t, const Estimate& estimate) const {
  if (t - asked_to_land_ > kLongestWay + kBraking) return true;  // gusts may never let it rest
  if (estimate.v_WB.norm() > kAtRest) return false;
  if (IsOverdue(t)) return true;
  const Plan* plan = plans_.FlownAt(t);
  if (plan == nullptr || !plan->to_land) return t - asked_to_land_ > world::kMostAge.landing_plan;
  if (plan->stop && t >= plan->stop->start)  // whoever leads it there has fallen silent
    return t - std::max(asked_to_land_, plan->stop->start) > world::kMostAge.landing_plan;
  const world::Trajectory& way = plan->position;
  return (way.Position(way.end()) - estimate.p_WB).head<2>().norm() < kAtEnd;
}

bool Controller::IsOverdue(double t) const { return t - asked_to_land_ > kLongestWay; }

// Held above the spot by the position, down by the vertical velocity alone.
std::optional<Setpoint> Controller::Descend(double t, const Estimate& estimate, double dt) {
  if (!flying_ || !lands_) return std::nullopt;
  if (!spot_ && !MayDescend(t, estimate)) return IsOverdue(t) ? Brake(estimate) : std::nullopt;
  if (!spot_) {
    spot_ = estimate.p_WB;
    landing_ = Landing(config_);
    yaw_on_spot_ = last_yaw_;
  }
  Reference down;
  down.state.p = {spot_->x(), spot_->y(), estimate.p_WB.z()};
  down.state.v.z() = estimate.v_WB.z();
  down.state.a.z() = landing_.Lift(estimate, Felt(dt));
  down.yaw = yaw_on_spot_;
  following_ = Following::kLand;
  const Setpoint setpoint = law_.Track(estimate, down, down, obeys_ ? dt : 0.0);
  return Finite(setpoint) ? setpoint : law_.Level(last_yaw_, -config_.lost_descent);
}

std::optional<Setpoint> Controller::Brake(const Estimate& estimate) {
  if (!flying_) return std::nullopt;
  following_ = Following::kBrake;
  const Setpoint setpoint = law_.Brake(estimate, last_yaw_);
  return Finite(setpoint) ? setpoint : law_.Level(last_yaw_, -config_.lost_descent);
}

// The autopilot wants to be asked for something before it obeys. By thrust above MPC_MANTHR_MIN,
// 0.08 of the full one, PX4 takes itself to have taken off; `min_thrust` is 0.1 at a hover of 0.5.
Setpoint Controller::Idle() const {
  Setpoint setpoint = law_.Level(last_yaw_, 0.0);
  setpoint.thrust = 0.0;
  setpoint.motors = !lands_;
  return setpoint;
}

std::optional<Setpoint> Controller::Off() {
  if (!flying_) return std::nullopt;
  following_ = Following::kLand;
  Setpoint setpoint = law_.Level(last_yaw_, 0.0);
  setpoint.motors = false;
  setpoint.thrust = 0.0;
  return setpoint;
}

std::optional<Setpoint> Controller::WithoutPose(double t, const Estimate& estimate, Health health,
                                                double dt) {
  if (!flying_) return std::nullopt;
  lost_ = true;
  const bool known = health == Health::kLost;
  const bool usable = known && estimate.velocity_sigma <= config_.UsableVelocitySigma();
  // Inertia drifts since the velocity was measured, dead reckoning since there was one.
  const double since = known ? last_measured_ : last_usable_;
  if (!spot_ && !is_down() && t - since <= world::kMostAge.velocity) {
    if (usable) reckoning_.Begin(t, estimate);
    return Brake(reckoning_.At(t));
  }
  following_ = Following::kLand;
  const double lift = known ? landing_.Lift(estimate, Felt(dt)) : -config_.lost_descent;
  if (is_down()) return Off();
  if (!usable) return law_.Level(last_yaw_, lift);
  const Setpoint setpoint = law_.Sink(estimate, last_yaw_, lift);
  return Finite(setpoint) ? setpoint : law_.Level(last_yaw_, -config_.lost_descent);
}

std::optional<Setpoint> Controller::Blind(double silence) {
  if (!flying_) return std::nullopt;
  if (cut_) return Off();
  const double t = last_t_.value_or(0.0) + silence;
  return Sent(t, WithoutPose(t, {}, Health::kStarting, 0.0));
}

void Controller::UpdateLate(double t, const Estimate& estimate, Health health) {
  if (health != Health::kUsable || !Usable(estimate) || t <= last_usable_) return;
  last_usable_ = t;
  if (estimate.velocity_sigma <= kMeasured) last_measured_ = t;
  reckoning_.Begin(t, estimate);
}

void Controller::TurnFrame(double t, double yaw) {
  if (!std::isfinite(yaw)) return;
  const double turn = yaw - math::Yaw(reckoning_.At(t).R_WB);
  reckoning_.Turn(turn);
  law_.Turn(turn);
  last_yaw_ = yaw;
}

// Somebody set the clock: plans are of another time, and the body still flies.
void Controller::FollowTimeBack(double t) {
  if (!last_t_ || t >= *last_t_ - world::kSetBack) return;
  const double back = t - *last_t_;
  for (double* time : {&last_usable_, &last_measured_, &asked_to_land_}) *time += back;
  reckoning_.Shift(back);
  plans_.Clear();
  bound_ = ErrorBound(config_.tracking_tube);
  last_t_ = t;
}

double Controller::StepTo(double t) {
  const double dt = last_t_ ? std::max(0.0, t - *last_t_) : 0.0;
  last_t_ = std::max(t, last_t_.value_or(t));
  return dt;
}

}  // namespace chase::control
