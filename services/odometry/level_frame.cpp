#include "services/odometry/level_frame.h"

#include "common/math/rotation.h"

namespace chase::odometry {

void LevelFrame::SetGravity(const Eigen::Vector3d& g) {
  gravity_ = g.norm();
  R_WM_ = Eigen::Quaterniond::FromTwoVectors(g, -Eigen::Vector3d::UnitZ());
}

/// An error e of gravity, seen in W, turns W by phi with phi x z = e / |g|; that moves a point at d
/// from the start by phi x d.
Eigen::Matrix<double, 9, 9> LevelFrame::CovarianceInWorld(const NavState& state) const {
  const Eigen::Matrix3d R = R_WM_.toRotationMatrix();
  Eigen::Matrix3d phi_of_e = Eigen::Matrix3d::Zero();
  phi_of_e(0, 1) = -1.0 / gravity_;
  phi_of_e(1, 0) = 1.0 / gravity_;
  const Eigen::Matrix3d turn = phi_of_e * R;
  Eigen::Matrix<double, 9, kStates> J = Eigen::Matrix<double, 9, kStates>::Zero();
  for (int block : {kP, kV, kTheta}) J.block<3, 3>(block, block) = R;
  J.block<3, 3>(kP, kGravity) = -math::Hat(R * (state.p - start_)) * turn;
  J.block<3, 3>(kV, kGravity) = -math::Hat(R * state.v) * turn;
  J.block<3, 3>(kTheta, kGravity) = turn;
  return J * state.P * J.transpose();
}

}  // namespace chase::odometry
