#pragma once

#include <optional>
#include <string>

#include "services/control/control_config.h"
#include "services/control/dead_reckoning.h"
#include "services/control/error_bound.h"
#include "services/control/landing.h"
#include "services/control/plan_follower.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// How far the estimate can be trusted.
enum class Health {
  kUsable,
  kLost,      ///< no position; a velocity with its deviation
  kStarting,  ///< nothing of it
};

/// What is followed; the numbers of tracking_t.
enum class Following {
  kNone,  ///< nothing to fly yet: no setpoint
  kPlan,
  kStop,   ///< no newer plan in time: the plan's stop, or its end
  kBrake,  ///< against the velocity: no plan, or no position
  kLand,   ///< down: no velocity either, or asked for
};

/// Plans and pose in, setpoint out. Never anything that is not finite. Plans are to have passed
/// `Refute`.
class Controller {
 public:
  explicit Controller(const ControlConfig& config)
      : config_(config), law_(config), landing_(config), reckoning_(config) {}

  /// Nothing, or why the plan is left out: it is late or unusable, or starts where neither the
  /// reference nor the body is by then.
  std::string AddPlan(const Plan& plan);

  /// Frame W has changed: all plans are void.
  void ForgetPlans() {
    plans_.Clear();
    spot_.reset();
  }

  /// The attitude loop goes by the new frame from time t, s, on, when the body's heading is `yaw`,
  /// rad, in it.
  void TurnFrame(double t, double yaw);

  /// A landing is asked for, or no more: it begins once the body is at rest where a plan to land
  /// ends; without such a plan after kMostAge.landing_plan, where it is at rest.
  void SetLanding(bool wanted);

  /// Does the autopilot fly by what it is asked for? Nothing is learnt from what it does otherwise.
  /// `stands`: it says that it is on the ground while a flight is asked for. Until it obeys and a
  /// plan begins the motors are to idle then; for a landing, to stop. `may_begin`: no while it
  /// stands there, no flight is asked for and it does not obey, when no plan starts the motors.
  void SetAutopilot(bool obeys, bool stands, bool may_begin = true) {
    obeys_ = obeys;
    stands_ = stands;
    may_begin_ = may_begin;
  }

  /// Motors off for good, at once, wherever it is: the flight is over, or somebody has ended it.
  void Cut() { cut_ = true; }

  /// Setpoint for time t [s] of the estimate, nothing while there is nothing to fly. Once flying:
  /// no plan, brake; no usable pose, brake until kMostAge.velocity after the velocity was measured,
  /// by dead reckoning where the estimate is not finite or starting; then land. Motors that have
  /// been stopped on the ground stay so. Where time jumps back it brakes
  /// until a plan of the new time comes.
  std::optional<Setpoint> Update(double t, const Estimate& estimate, Health health);

  /// A usable pose of time t [s] that comes too late to be flown by: dead reckoning begins there.
  void UpdateLate(double t, const Estimate& estimate, Health health);

  /// Setpoint `silence` s after the last pose while none comes in time: by dead reckoning, as
  /// above; nothing while there is nothing to fly.
  std::optional<Setpoint> Blind(double silence);

  Following following() const { return following_; }
  /// Brakes to come down where it is: the time to be led to a place to land is over.
  bool brakes_to_land() const {
    return lands_ && following_ == Following::kBrake && last_t_ && IsOverdue(*last_t_);
  }
  bool is_down() const { return landing_.is_down(); }
  bool is_cut() const { return cut_; }
  bool stands() const { return stands_; }
  /// Reference minus estimate, m; 0 unless there is a reference that is followed.
  const Eigen::Vector3d& error() const { return error_; }
  double error_bound() const { return bound_.value(); }  ///< of its length, m
  int32_t plan_seq() const { return plan_seq_; }         ///< of the plan followed last; -1: none
  double overdue() const { return overdue_; }            ///< since the stop began, s

 private:
  std::optional<Setpoint> Follow(double t, const Estimate& estimate, double dt);
  std::optional<Setpoint> Brake(const Estimate& estimate);
  std::optional<Setpoint> Descend(double t, const Estimate& estimate, double dt);
  std::optional<Setpoint> Off();
  bool Waits(double t) const { return stands_ && !flying_ && !(obeys_ && plans_.FlownAt(t)); }
  Setpoint Idle() const;
  /// What a landing that somebody else flies feels is not the ground.
  double Felt(double dt) const { return obeys_ || stands_ ? dt : 0.0; }
  std::optional<Setpoint> Answer(double t, const Estimate& estimate, Health health, double dt);
  std::optional<Setpoint> Sent(double t, std::optional<Setpoint> setpoint);
  std::optional<Setpoint> WithoutPose(double t, const Estimate& estimate, Health health, double dt);
  void FollowTimeBack(double t);
  double StepTo(double t);
  bool IsNear(const Plan& plan) const;
  bool MayDescend(double t, const Estimate& estimate) const;
  bool IsOverdue(double t) const;

  ControlConfig config_;
  PlanFollower plans_;
  TrackingLaw law_;
  Landing landing_;
  DeadReckoning reckoning_;
  ErrorBound bound_{config_.tracking_tube};
  std::optional<double> last_t_;
  Estimate last_estimate_;
  double last_usable_ = 0.0, last_measured_ = 0.0;  // of the pose, the velocity; s
  bool flying_ = false, lost_ = false;
  bool lands_ = false;          // a landing is asked for
  double asked_to_land_ = 0.0;  // when, s
  bool cut_ = false;
  bool obeys_ = true, stands_ = false, may_begin_ = true;  // the autopilot
  std::optional<Eigen::Vector3d> spot_;                    // above which it comes down, frame W, m
  Following following_ = Following::kNone;
  double last_yaw_ = 0.0, yaw_on_spot_ = 0.0;  // rad
  Eigen::Vector3d error_ = Eigen::Vector3d::Zero();
  int32_t plan_seq_ = -1;
  double overdue_ = 0.0;  // s
};

}  // namespace chase::control
