#pragma once

#include "services/control/controller.h"
#include "test/unit/control_body.h"

namespace chase::control::test {

using Eigen::Vector3d;

inline constexpr double kStep = 0.005;  // s

inline Plan PointPlan(const Vector3d& p, double start = 0.0) {
  return {world::Trajectory::Constant(p, start, 1.0), Eigen::VectorXd::Zero(1), {}};
}

/// Along x at `speed`, for 5 s.
inline Plan LinePlan(const Vector3d& p, double speed, double start = 0.0) {
  Plan plan = PointPlan(p, start);
  plan.position.duration = 5.0;
  plan.position.coefficients.conservativeResize(2, 3);
  plan.position.coefficients.row(1) = Eigen::RowVector3d(5.0 * speed, 0.0, 0.0);
  return plan;
}

/// A body over the ground at z = 0, and what inertial sensors make of it: position lost, velocity
/// off by a bias that grows with `drift` m/s^2.
class Flight {
 public:
  explicit Flight(const Vector3d& p, const ControlConfig& config = {}) : controller(config) {
    body.p = p;
  }

  /// Flies on until `until`, s.
  void Fly(double until, Health health) {
    for (; t < until - 1e-9; t += kStep) {
      const Vector3d v = body.v;
      Estimate estimate = body.Measured();
      estimate.a_WB = a_;
      estimate.velocity_sigma = velocity_sigma;
      if (health != Health::kUsable) {
        estimate.p_WB += Vector3d(30, 0, -50);
        estimate.v_WB += (lost_for_ += kStep) * drift;
        estimate.a_WB += drift;
      }
      setpoint = *controller.Update(t, estimate, health);
      if (!setpoint.motors && off_at < 0.0) off_at = t;
      body.Step(setpoint);
      if (body.p.z() < 0.0) {
        if (down_at < 0.0) down_at = t, impact = -v.z(), skid = v.head<2>().norm();
        body.p.z() = 0.0, body.v.setZero();
      }
      a_ = (body.v - v) / kStep;
      fastest = std::max(fastest, body.v.norm());
    }
  }

  Controller controller;
  Body body;
  Vector3d drift = Vector3d::Zero();
  Setpoint setpoint;
  double t = 0.0, down_at = -1.0, off_at = -1.0, impact = 0.0, fastest = 0.0;
  double skid = 0.0, velocity_sigma = 0.0;

 private:
  Vector3d a_ = Vector3d::Zero();
  double lost_for_ = 0.0;
};

}  // namespace chase::control::test
