#include "services/odometry/level_frame.h"

#include "common/math/rotation.h"

namespace chase::odometry {

void LevelFrame::Turn(const NavState& state) {
  gravity_ = state.g.norm();
  R_WM_ = math::FromYaw(-up_B_.dot(state.mount)) *
          Eigen::Quaterniond::FromTwoVectors(state.g, -Eigen::Vector3d::UnitZ());
}

/// An error e of gravity, seen in W, turns W by phi with phi x z = e / |g|; that moves a point at d
/// from the start by phi x d. An error m of the mounting turns W by -z (z . R_MB m), R_MB that of
/// the start, and the body in it.
Eigen::Matrix<double, 9, 9> LevelFrame::CovarianceInWorld(const NavState& state) const {
  const Eigen::Matrix3d R = R_WM_.toRotationMatrix();
  Eigen::Matrix3d phi_of_e = Eigen::Matrix3d::Zero();
  phi_of_e(0, 1) = -1.0 / gravity_;
  phi_of_e(1, 0) = 1.0 / gravity_;
  Eigen::Matrix<double, 3, 6> turn;  // of W, by the errors of gravity and of the mounting
  turn << phi_of_e * R, -Eigen::Vector3d::UnitZ() * up_B_.transpose();
  Eigen::Matrix<double, 9, kStates> J = Eigen::Matrix<double, 9, kStates>::Zero();
  for (int block : {kP, kV, kTheta}) J.block<3, 3>(block, block) = R;
  J.block<3, 6>(kP, kGravity) = -math::Hat(R * (state.p - start_)) * turn;
  J.block<3, 6>(kV, kGravity) = -math::Hat(R * state.v) * turn;
  J.block<3, 6>(kTheta, kGravity) = turn;
  J.block<3, 3>(kTheta, kMount) += R * state.R_WB.toRotationMatrix();
  return J * state.P * J.transpose();
}

}  // namespace chase::odometry
