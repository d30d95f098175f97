#pragma once

#include <Eigen/Geometry>

namespace chase::math {

/// The angle in (-pi, pi] that differs from `angle` by whole turns [rad].
double WrapAngle(double angle);

/// The angle nearest to `reference` that differs from `angle` by whole turns [rad].
double UnwrapAngle(double angle, double reference);

/// Heading of the body's x axis about z [rad].
double Yaw(const Eigen::Quaterniond& R_WB);

/// Rotation about z by `yaw` rad.
Eigen::Quaterniond FromYaw(double yaw);

/// R_WB whose z axis is `z_W` (any length above 0) and whose x axis points to heading `yaw` as far
/// as that z axis allows. Level flight at that heading where z_W is zero or lies along the heading.
Eigen::Quaterniond FromZAxisAndYaw(const Eigen::Vector3d& z_W, double yaw);

/// Skew-symmetric matrix with Hat(a) b = a x b.
Eigen::Matrix3d Hat(const Eigen::Vector3d& a);

/// Rotation by |w| rad about w, and its inverse with |result| <= pi.
Eigen::Quaterniond ExpSO3(const Eigen::Vector3d& w);
Eigen::Vector3d LogSO3(const Eigen::Quaterniond& R);

/// J_r(w): ExpSO3(w + dw) = ExpSO3(w) ExpSO3(J_r(w) dw) to first order.
Eigen::Matrix3d RightJacobianSO3(const Eigen::Vector3d& w);

}  // namespace chase::math
