#include "common/math/rotation.h"

#include <cmath>

namespace chase::math {

double WrapAngle(double angle) {
  const double wrapped = std::remainder(angle, 2.0 * M_PI);
  return wrapped <= -M_PI ? M_PI : wrapped;
}

double UnwrapAngle(double angle, double reference) {
  return reference + std::remainder(angle - reference, 2.0 * M_PI);
}

double Yaw(const Eigen::Quaterniond& R_WB) {
  const Eigen::Vector3d x_W = R_WB * Eigen::Vector3d::UnitX();
  return std::atan2(x_W.y(), x_W.x());
}

Eigen::Quaterniond FromYaw(double yaw) {
  return {std::cos(0.5 * yaw), 0.0, 0.0, std::sin(0.5 * yaw)};
}

Eigen::Quaterniond FromZAxisAndYaw(const Eigen::Vector3d& z_W, double yaw) {
  const Eigen::Vector3d heading(std::cos(yaw), std::sin(yaw), 0.0);
  const double length = z_W.norm();
  const Eigen::Vector3d y_raw = z_W.cross(heading);
  if (!(length > 1e-9) || !(y_raw.norm() > 1e-6 * length)) return FromYaw(yaw);
  Eigen::Matrix3d R;
  R.col(2) = z_W / length;
  R.col(1) = y_raw.normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  return Eigen::Quaterniond(R).normalized();
}

Eigen::Matrix3d Hat(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

Eigen::Quaterniond ExpSO3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  // sin(x/2)/x = 1/2 - x^2/48 + O(x^4)
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q(std::cos(0.5 * angle), scale * w.x(), scale * w.y(), scale * w.z());
  return q.normalized();
}

Eigen::Vector3d LogSO3(const Eigen::Quaterniond& R) {
  const double sign = R.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * R.vec();
  const double sine = v.norm();
  const double angle = 2.0 * std::atan2(sine, sign * R.w());
  return sine < 1e-9 ? Eigen::Vector3d(2.0 * v) : Eigen::Vector3d(angle / sine * v);
}

Eigen::Matrix3d RightJacobianSO3(const Eigen::Vector3d& w) {
  const double x = w.norm();
  const Eigen::Matrix3d W = Hat(w);
  if (x < 1e-5) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6.0;
  return Eigen::Matrix3d::Identity() - (1.0 - std::cos(x)) / (x * x) * W +
         (x - std::sin(x)) / (x * x * x) * W * W;
}

}  // namespace chase::math
