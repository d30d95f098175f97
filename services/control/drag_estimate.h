#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>

namespace chase::control {

/// Linear drag over mass, 1/s, apart from a wind that lasts: across the body's z axis a rotor gives
/// no thrust, so what the accelerometer feels there is drag against the air (Abeywardena, Kodagoda,
/// Dissanayake, Munasinghe 2013). Least squares with forgetting of force = c - d v, c the drag of
/// the wind, about a first guess of d and no wind.
class DragEstimate {
 public:
  explicit DragEstimate(double guess) : guess_(guess) {}

  /// `force`: specific force in the body's axes R_WB, m/s^2; `v`: v_WB, m/s; both held for `dt`, s.
  void Add(const Eigen::Vector3d& force, const Eigen::Vector3d& v, const Eigen::Matrix3d& R_WB,
           double dt) {
    const double kept = std::max(0.0, 1.0 - dt / kMemory);
    information_ *= kept;
    sums_ *= kept;
    const double weight = dt / (kGust * kNoise * kNoise);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d e = R_WB.col(axis);
      const Eigen::Vector3d row(-e.dot(v), e.x(), e.y());
      information_ += weight * row * row.transpose();
      sums_ += weight * (force[axis] + guess_ * e.dot(v)) * row;
    }
    if (!information_.allFinite() || !sums_.allFinite()) *this = DragEstimate(guess_);
  }
  double value() const {
    Eigen::Matrix3d information = information_;
    information.diagonal() += kPrior.cwiseAbs2().cwiseInverse();
    const double most = 4.0 * kPrior.x();  // a pose that is wrong must not drive it anywhere
    return std::max(0.0, guess_ + std::clamp(information.ldlt().solve(sums_).x(), -most, most));
  }
  /// Frame W has turned by `yaw`, rad.
  void Turn(double yaw) {
    const Eigen::Matrix3d turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitX()));  // of c alone
    information_ = turn * information_ * turn.transpose();
    sums_ = turn * sums_;
  }

 private:
  static constexpr double kMemory = 10.0;  // s: a wind's; the drag stays as it is
  static constexpr double kGust = 0.5;     // s over which what is not modelled stays alike
  static constexpr double kNoise = 0.5;    // of that, m/s^2: gusts of 2 m/s at a drag of 0.25
  // Of d (between a bare frame and one with ducts) and of c (4 m/s of wind, drag 0.25).
  inline static const Eigen::Vector3d kPrior = {0.25, 1.0, 1.0};

  double guess_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();  // of (d - guess, c_x, c_y)
  Eigen::Vector3d sums_ = Eigen::Vector3d::Zero();
};

}  // namespace chase::control
