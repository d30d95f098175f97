#pragma once

#include <optional>

#include "services/control/control_config.h"
#include "services/control/plan_follower.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// How far the estimate can be trusted.
enum class Health { kUsable, kLost, kStarting };

/// What the last update did.
enum class Mode {
  kIdle,      ///< nothing to fly yet: no setpoint
  kTracking,  ///< on a plan
  kHolding,   ///< at rest on the end of a plan that no newer one followed
  kLevel,     ///< pose lost: level, sinking slowly
};

/// Plans and pose in, setpoint out. Never anything that is not finite.
class Controller {
 public:
  explicit Controller(const ControlConfig& config)
      : config_(config), plans_(config.slow_down), law_(config) {}

  /// False when the plan is late or unusable.
  bool AddPlan(const Plan& plan) { return plans_.Add(plan); }

  /// Setpoint for time t [s] of the estimate, nothing while there is nothing to fly. An estimate
  /// that is not usable or not finite gives a level attitude once flying. Time that jumps back
  /// starts the controller anew.
  std::optional<Setpoint> Update(double t, const Estimate& estimate, Health health);

  Mode mode() const { return mode_; }
  /// Distance of the last estimate from the reference, m; 0 unless tracking or holding.
  double position_error() const { return position_error_; }
  /// Seconds since the end of the newest plan; negative before it.
  double overdue() const { return plans_.Overdue(last_t_.value_or(0.0)); }

 private:
  std::optional<Setpoint> Level();
  void RestartIfTimeJumpedBack(double t);
  double StepTo(double t);

  ControlConfig config_;
  PlanFollower plans_;
  TrackingLaw law_;
  std::optional<double> last_t_;
  bool flying_ = false;
  Mode mode_ = Mode::kIdle;
  double last_yaw_ = 0.0;  // rad
  double position_error_ = 0.0;
};

}  // namespace chase::control
