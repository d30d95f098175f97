#pragma once

#include <Eigen/Core>
#include <optional>

#include "services/odometry/sweep.h"

namespace chase::odometry {

struct FilterConfig {
  double gyro_noise = 0.0003;            ///< rad/s/sqrt(Hz)
  double accel_noise = 0.003;            ///< m/s^2/sqrt(Hz)
  double gyro_bias_walk = 1e-4;          ///< rad/s^2/sqrt(Hz)
  double accel_bias_walk = 1e-3;         ///< m/s^3/sqrt(Hz)
  double gravity = 9.81;                 ///< m/s^2
  double accel_bias_sigma = 0.05;        ///< at the start, m/s^2
  double gyro_bias_sigma = 0.0005;       ///< after an alignment at rest, rad/s
  double mount_sigma = 0.00175;          ///< per axis: 0.1 deg, rad
  double doubt_accel = 0.1;              ///< error of the accelerometer beyond its noise, m/s^2
  double map_tilt = 1e-3;                ///< rad
  double blind_accel = 3.0;              ///< what a body without IMU may do, m/s^2
  double blind_rate = 1.0;               ///< rad/s
  double usual_nis = 6.0;                ///< per direction
  double largest_nis = 100.0;            ///< per direction
  double match_position_floor = 0.0005;  ///< what a scan match never gets below, m
  double match_rotation_floor = 0.0001;  ///< rad

  template <class V>
  void Visit(V& v) {
    v("gyro_noise", gyro_noise, "rad/s/sqrt(Hz)");
    v("accel_noise", accel_noise, "m/s^2/sqrt(Hz)");
    v("gyro_bias_walk", gyro_bias_walk, "rad/s^2/sqrt(Hz)");
    v("accel_bias_walk", accel_bias_walk, "m/s^3/sqrt(Hz)");
    v("gravity", gravity, "m/s^2");
    v("accel_bias_sigma", accel_bias_sigma, "at the start, m/s^2");
    v("gyro_bias_sigma", gyro_bias_sigma, "after an alignment at rest, rad/s");
    v("mount_sigma", mount_sigma, "of the lidar's calibrated attitude, per axis, rad");
    v("doubt_accel", doubt_accel, "what the accelerometer may be off while no sweep comes, m/s^2");
    v("map_tilt", map_tilt,
      "how well a map is level; gravity pulls along it where nothing holds, rad");
    v("blind_accel", blind_accel, "what the body may do while the IMU is silent, m/s^2");
    v("blind_rate", blind_rate, "the same for rotation, rad/s");
    v("usual_nis", usual_nis, "normalised innovation squared per direction that needs no doubt");
    v("largest_nis", largest_nis, "and above which a match is refused");
    v("match_position_floor", match_position_floor, "no scan match is better than this, m");
    v("match_rotation_floor", match_rotation_floor, "no scan match is better than this, rad");
  }
};

/// Order of the error state: each block three wide.
enum ErrorBlock {
  kP = 0,
  kV = 3,
  kTheta = 6,
  kGyroBias = 9,
  kAccelBias = 12,
  kGravity = 15,
  kMount = 18
};
constexpr int kStates = 21;
using ErrorCovariance = Eigen::Matrix<double, kStates, kStates>;
using ErrorVector = Eigen::Matrix<double, kStates, 1>;

/// What the filter knows of the body. Frame W unless named otherwise. The rotation error is in W:
/// R_WB(true) = Exp(d_theta) R_WB. B is the body as sweeps show it, by the calibrated attitude of
/// the LiDAR; what that is off turns the IMU's frame I against B.
struct NavState {
  double t = 0.0;  ///< s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();           ///< m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();           ///< m/s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< frame I, rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< frame I, m/s^2
  Eigen::Vector3d mount = Eigen::Vector3d::Zero();       ///< R_BI = Exp(mount), rad
  Eigen::Vector3d g = {0.0, 0.0, -9.81};                 ///< gravity, m/s^2
  Eigen::Vector3d w_B = Eigen::Vector3d::Zero();         ///< last w_WB_B, rad/s
  Eigen::Vector3d a = Eigen::Vector3d::Zero();           ///< last a_WB, m/s^2
  ErrorCovariance P = ErrorCovariance::Zero();

  Pose pose() const { return {R_WB, p}; }
};

/// Advances to `imu.t` under constant specific force and angular velocity. Solà 2017, "Quaternion
/// kinematics for the error-state Kalman filter", section 5, with the rotation error on the left.
/// A sample before the state's time takes it back there.
void Propagate(const FilterConfig& config, const ImuSample& imu, NavState* state);

/// What may have passed between two samples `dt` s apart: a change from one to the other that noise
/// does not explain may have come at any time between, so their mean times dt has the variance
/// (change dt)^2 / 12 (uniform distribution). Legs that hit the ground shock faster than one
/// samples.
void AddUnsampled(const FilterConfig& config, const ImuSample& from, const ImuSample& to, double dt,
                  NavState* state);

/// Advances to `t` at constant velocity and angular velocity: all one can do while the IMU is
/// silent.
void PropagateBlind(const FilterConfig& config, double t, NavState* state);

/// Adds what the model of the inertial unit does not know (shocks, heat, tones) over `gap` s
/// without a sweep: what is off by a constant is no noise that averages out.
void Doubt(const FilterConfig& config, double gap, NavState* state);

/// Attitude is taken from the map, whose own tilt turns gravity into an acceleration that never
/// averages out. Where a sweep holds the place this is seen; along the directions that `unheld`
/// projects on, acceleration is never known any better.
void DoubtAcceleration(const FilterConfig& config, const Eigen::Matrix3d& unheld, NavState* state);

/// Adds `dx` to the state.
void Inject(const ErrorVector& dx, NavState* state);

/// A pose as measured, of which only the directions `known` (orthonormal columns: p, rotation error
/// in W) count; along the others it was kept at the prediction.
struct PoseMeasurement {
  Pose X_WB;
  Eigen::Matrix<double, 6, Eigen::Dynamic> known;
  Eigen::Matrix<double, 6, 6> information;  ///< of (p, rotation error in W)
  double gate = 0.0;                        ///< how far off a feature was still matched, m
};

/// Update of a body that stands: no velocity, and what the gyroscope shows [rad/s] is its bias.
void HoldStill(const Eigen::Vector3d& gyro, NavState* state);

struct UpdateResult {
  bool applied = false;
  double nis = 0.0;  ///< normalised innovation squared per known direction
};

/// State under the hypothesis that the biases jumped before the first of `matches`. One match that
/// is a centimetre off and a jump look alike: those that follow have to tell.
struct JumpHypothesis {
  NavState state;
  double log_likelihood_ratio = 0.0;  ///< of these matches, to that nothing jumped
  int matches = 0;
};

/// Kalman update; leaves the state as it is where the numbers do not allow one or the innovation is
/// too large to be of noise. One that is larger than the covariances explain makes these larger: by
/// as much of the correction as they do not explain. `gap`: s since the update before, in which the
/// biases may have jumped; 0: they have not. Where that explains the match far better, the
/// hypothesis `jump` is opened, if given; an earlier one, brought up to this time, is weighed by
/// the match, and becomes the state or is dropped (generalised likelihood ratio, Willsky and Jones
/// 1976; sequential, Wald 1945).
UpdateResult Update(const FilterConfig& config, const PoseMeasurement& z, double gap,
                    NavState* state, std::optional<JumpHypothesis>* jump = nullptr);

}  // namespace chase::odometry
