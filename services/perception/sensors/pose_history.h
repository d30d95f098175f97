#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>

namespace chase::perception {

/// State of the body at one time. Frame W unless said otherwise.
struct PoseSample {
  double t = 0.0;                                  ///< s
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Vector3d a_WB = Eigen::Vector3d::Zero();  ///< m/s^2
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< frame B, rad/s
  /// Of (p_WB, rotation error in W); m, rad.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// The last second of poses, to ask where the body was.
class PoseHistory {
 public:
  static constexpr double kSpan = 1.0;  ///< s that are kept; further back a new recording begins

  /// Samples that do not move time forward are left out; a jump back by more than a second starts
  /// anew.
  void Add(const PoseSample& sample);

  /// Pose at t: between two samples at most 0.15 s apart, or carried by its rates from the last
  /// sample forward, or from the first one kept back, for at most `max_extrapolation` s. Nothing
  /// when t lies further outside, or in a longer gap, however near to one of its ends.
  std::optional<PoseSample> At(double t, double max_extrapolation) const;

  /// The sample nearest to t if it is at most `max_age` s away.
  std::optional<PoseSample> Nearest(double t, double max_age) const;

 private:
  std::deque<PoseSample> samples_;
};

}  // namespace chase::perception
