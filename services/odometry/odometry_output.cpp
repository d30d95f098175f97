// What odometry puts out of its state.
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/odometry.h"

namespace chase::odometry {

RegisteredSweep Odometry::Registered(const Prepared& prepared) const {
  const Pose X_WB = level_.ToWorld(base_.pose());
  RegisteredSweep out;
  out.t = prepared.end;
  out.epoch = epoch_;
  out.X_WL = X_WB * X_BL_;
  const FloatPose to_world(X_WB);
  const size_t n = prepared.at_end.size();
  out.x.resize(n), out.y.resize(n), out.z.resize(n), out.intensity.resize(n), out.ring.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3f p = to_world * prepared.at_end[i];
    out.x[i] = p.x(), out.y[i] = p.y(), out.z[i] = p.z();
    out.intensity[i] = prepared.sweep.points[i].intensity;
    out.ring[i] = prepared.sweep.points[i].ring;
  }
  return out;
}

/// None for an instant whose pose was published before.
std::optional<PoseEstimate> Odometry::NewEstimate() {
  if (live_.t <= newest_pose_) return std::nullopt;
  newest_pose_ = live_.t;
  return Estimate();
}

PoseEstimate Odometry::Estimate() const {
  PoseEstimate out;
  out.t = live_.t;
  out.X_WB = blend_.Applied(level_.ToWorld(live_));
  out.v = blend_.AppliedVelocity(level_.R_WM() * live_.v);
  out.w_B = math::ExpSO3(-live_.mount) * live_.w_B;
  out.a = level_.R_WM() * live_.a;
  out.gyro_bias = live_.gyro_bias;
  out.accel_bias = live_.accel_bias;
  const NavState doubted = Doubted(live_);
  out.covariance = level_.CovarianceInWorld(doubted);
  out.covariance += blend_.rest() * blend_.rest().transpose();
  out.local_covariance = doubted.P.topLeftCorner<9, 9>();
  out.covariance.topLeftCorner<3, 3>() += drift_.covariance().topLeftCorner<3, 3>();
  out.covariance.block<3, 1>(0, 8) += drift_.covariance().topRightCorner<3, 1>();
  out.covariance.block<1, 3>(8, 0) += drift_.covariance().bottomLeftCorner<1, 3>();
  out.covariance(8, 8) += drift_.covariance()(3, 3);
  const double sigma = std::sqrt(std::max(0.0, doubted.P.topLeftCorner<3, 3>().trace()));
  const double speed_sigma = std::sqrt(std::max(0.0, doubted.P.block<3, 3>(3, 3).trace()));
  // Without an inertial unit the velocity is what the last sweeps showed, and doubted accordingly.
  out.health = health_.At(live_.t, sigma, Blind(live_.t) ? 0.0 : speed_sigma);
  out.correcting = blend_.correcting();
  out.epoch = epoch_;
  return out;
}

}  // namespace chase::odometry
