#pragma once

#include "services/control/control_config.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// Down to the ground by the vertical velocity, which needs no position.
/// The ground is what bears a part of the weight for a while: in the air the vertical acceleration
/// is what thrust and weight make of it. After PX4's land detector (little thrust and no vertical
/// motion for a time). Once something strikes the body from below thrust is cut for a
/// moment: where the velocity says wrongly that it sinks, the ground would else bear too little to
/// be felt.
class Landing {
 public:
  explicit Landing(const ControlConfig& config)
      : gain_(config.velocity_gain.z()),
        speed_(config.land_speed),
        blind_lift_(-config.lost_descent),
        usable_sigma_(config.UsableVelocitySigma()) {}

  /// Thrust beyond that of hovering, m/s^2, after `dt` s with the last one. A velocity that is not
  /// usable may make it sink faster, but not climb: ever less thrust, so that the ground is felt.
  double Lift(const Estimate& estimate, double dt);

  /// True once the ground has been felt for long enough; stays true.
  bool is_down() const { return is_down_; }

 private:
  void Feel(double support, double dt);
  double LiftFor(const Estimate& estimate, double dt);

  double gain_, speed_, blind_lift_, usable_sigma_;
  double lift_ = 0.0, integral_ = 0.0;  // m/s^2
  double support_ = 0.0;                // felt of late, over mass, m/s^2
  double supported_ = 0.0;              // for this long, s
  double pushes_ = 0.0;                 // for this long yet, s
  bool is_down_ = false;
};

}  // namespace chase::control
