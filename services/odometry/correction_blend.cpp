#include "services/odometry/correction_blend.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

/// x after dt of exponential decay, its change limited to rate * dt.
Eigen::Vector3d Decayed(const Eigen::Vector3d& x, double dt, double time_constant, double rate) {
  const double length = x.norm();
  if (length < 1e-12) return Eigen::Vector3d::Zero();
  const double wanted = length * (1.0 - std::exp(-dt / time_constant));
  return x * (1.0 - std::min(wanted, rate * dt) / length);
}

}  // namespace

void CorrectionBlend::Absorb(const Pose& before, const Eigen::Vector3d& v_before, const Pose& after,
                             const Eigen::Vector3d& v_after) {
  dp_ += before.p - after.p;
  dv_ += v_before - v_after;
  dtheta_ = math::LogSO3(math::ExpSO3(dtheta_) * before.R * after.R.conjugate());
}

void CorrectionBlend::Decay(double dt) {
  if (!(dt > 0.0)) return;
  dp_ = Decayed(dp_, dt, config_.time_constant, config_.position_rate);
  dv_ = Decayed(dv_, dt, config_.time_constant, config_.velocity_rate);
  dtheta_ = Decayed(dtheta_, dt, config_.time_constant, config_.rotation_rate);
}

Pose CorrectionBlend::Applied(const Pose& X_WB) const {
  return {(math::ExpSO3(dtheta_) * X_WB.R).normalized(), X_WB.p + dp_};
}

}  // namespace chase::odometry
