#include "services/control/landing.h"

#include <algorithm>

namespace chase::control {

namespace {

// In the air what thrust and weight leave unexplained is the error of the thrust's gain (0.4 m/s^2,
// 4 % of it, when the battery sags under the motors) and drag (0.15 1/s of 0.5 m/s, and of a gust
// of 3 m/s upwards): together below 1. On the ground the loop takes `land_speed` times its gain off
// the thrust, which is 1.8, and its integral besides.
constexpr double kSupport = 1.0;       // m/s^2
constexpr double kPush = -1.6;         // m/s^2: well above kSupport; a wrong knock costs 1.3 m/s
constexpr double kPushFor = 0.8;       // s: kSupportFor, smoothing and the motors' lag
constexpr double kSmoothing = 0.1;     // s: motors lag 0.05 s, and an accelerometer is noisy
constexpr double kSupportFor = 0.5;    // s: longer than a bump or a bounce
constexpr double kLeastLift = -3.0;    // m/s^2: leaves 70 % of the weight to steer with
constexpr double kMostLift = 1.0;      // m/s^2: a velocity that is wrong is not climbed after
constexpr double kIntegralGain = 2.0;  // 1/s^2: takes 2 s at a gain of 4 1/s
constexpr double kMostIntegral = 1.0;  // m/s^2
constexpr double kLongestStep = 0.05;  // s; over a longer gap the thrust was not this loop's

}  // namespace

double Landing::Lift(const Estimate& estimate, double dt) {
  if (dt > kLongestStep)
    support_ = supported_ = 0.0;
  else
    Feel(estimate.a_WB.z() - lift_, dt);
  return lift_ = LiftFor(estimate, std::min(dt, kLongestStep));
}

// The bound of a velocity that is not usable goes by the square of its deviation: where that grows
// by 0.1 m/s^2 the ground bears the 1 m/s^2 that are felt 21 s after the last sweep at the latest,
// and in the first 10 s no more than 0.2 m/s^2 of thrust are given up.
double Landing::LiftFor(const Estimate& estimate, double dt) {
  const double doubt = estimate.velocity_sigma / usable_sigma_;
  const double most = doubt > 1.0 ? std::max(kLeastLift, blind_lift_ * doubt * doubt) : kMostLift;
  const double error = -speed_ - estimate.v_WB.z();
  integral_ = std::clamp(integral_ + kIntegralGain * error * dt, -kMostIntegral, kMostIntegral);
  return std::clamp(gain_ * error + integral_, kLeastLift,
                    pushes_ > 0.0 ? std::min(kPush, most) : most);
}

void Landing::Feel(double support, double dt) {
  support_ += std::min(1.0, dt / kSmoothing) * (support - support_);
  pushes_ = support_ > kSupport ? kPushFor : std::max(0.0, pushes_ - dt);
  supported_ = support_ > kSupport ? supported_ + dt : 0.0;
  is_down_ = is_down_ || supported_ > kSupportFor;
}

}  // namespace chase::control
