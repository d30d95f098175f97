#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <string>

namespace chase::simulator {

inline constexpr double kGravity = 9.81;  // m/s^2

/// The airframe. Motors stand on the diagonals: front left, rear right, front right, rear left.
struct VehicleConfig {
  double mass = 1.5;
  Eigen::Vector3d inertia = {0.016, 0.017, 0.028};
  double arm = 0.17;
  double torque_ratio = 0.016;
  double motor_lag = 0.03;
  double max_thrust = 22.0;
  double thrust_error = -0.02, thrust_curve = 0.0, mass_error = 0.0;
  Eigen::Vector3d drag = {0.25, 0.25, 0.15};
  double leg_height = 0.12;
  double leg_spread = 0.12;

  template <class V>
  void Visit(V& v) {
    v("mass", mass, "kg");
    v("inertia", inertia, "principal, frame B, kg m^2");
    v("arm", arm, "motor to centre, m");
    v("torque_ratio", torque_ratio, "yaw torque over thrust of a motor, m");
    v("motor_lag", motor_lag, "time constant, s");
    v("max_thrust", max_thrust, "of all motors over mass, m/s^2");
    v("thrust_error", thrust_error, "true over commanded thrust, minus 1");
    v("thrust_curve", thrust_curve,
      "a motor asked for the share u of its most gives (1 - this) u + this u^2; 0: linear");
    v("mass_error", mass_error, "true mass over `mass`, which scales the commands, minus 1");
    v("drag", drag, "linear, over mass, frame B, 1/s");
    v("leg_height", leg_height, "of the body's origin when standing, m");
    v("leg_spread", leg_spread, "feet at +-this in x and y, m");
  }
  double TrueMass() const { return mass * (1.0 + mass_error); }  ///< kg
  std::string Problem() const;
};

/// Rigid-body state. p_WB, v_WB, a_WB in W; R_WB as quaternion; w_WB_B in B.
struct BodyState {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
  Eigen::Vector3d a = Eigen::Vector3d::Zero();  ///< without gravity's reaction: 0 at rest, m/s^2
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< rad/s
};

/// Collective thrust over mass [m/s^2] and torque [N m, frame B] asked of the motors.
struct Wrench {
  double thrust = 0.0;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
};

/// Rigid body with lagging motors, linear drag against the moving air, and legs on springs.
class Quadrotor {
 public:
  using Ground = std::function<double(double x, double y)>;

  Quadrotor(const VehicleConfig& config, const BodyState& start, Ground ground);

  /// Advances by dt [s] under the wrench wanted and the wind [m/s, frame W].
  void Step(const Wrench& wanted, const Eigen::Vector3d& wind, double dt);

  /// Shares of the thrusts that the motors give from now on.
  void SetMotorShares(const Eigen::Vector4d& shares) { motor_shares_ = shares; }
  /// The battery's share of all of them.
  void SetSupply(double share) { supply_ = share; }

  const BodyState& state() const { return state_; }
  /// True while a foot touches the ground.
  bool on_ground() const { return on_ground_; }
  const Eigen::Vector4d& motor_thrusts() const { return motors_; }  ///< as asked for, N
  double thrust() const { return MotorLoad().force.norm(); }        ///< that they give together, N

 private:
  struct Load {
    Eigen::Vector3d force;   ///< frame W, N
    Eigen::Vector3d torque;  ///< frame B, N m
  };
  Eigen::Vector4d Mix(const Wrench& wanted) const;
  Load MotorLoad() const;
  void AddLegs(Load* load);

  VehicleConfig config_;
  BodyState state_;
  Ground ground_;
  Eigen::Vector4d motors_ = Eigen::Vector4d::Zero();
  Eigen::Vector4d motor_shares_ = Eigen::Vector4d::Ones();
  double supply_ = 1.0;
  bool on_ground_ = false;
};

/// Height of the body's origin above flat ground at which the legs carry the weight [m].
double StandingHeight(const VehicleConfig& config);

}  // namespace chase::simulator
