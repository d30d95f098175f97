#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <deque>

#include "services/control/tracking_law.h"

namespace chase::control::test {

/// A rigid body with an attitude loop, written for these tests alone: it shares nothing with the
/// controller or with the simulator. Integrated with explicit steps of 1 ms.
struct Body {
  // What the world is like.
  Eigen::Vector3d wind = Eigen::Vector3d::Zero();  // m/s
  double drag = 0.25;                              // 1/s, against the air
  double mass_factor = 1.0;                        // true over assumed mass
  int latency_ms = 0;                              // of a setpoint
  // The motors give 1 + thrust_error + thrust_curve (asked / 9.81 - 1) of what they are asked.
  double thrust_error = 0.0, thrust_curve = 0.0;
  // What the vehicle is like.
  double attitude_gain = 6.5;          // 1/s
  double rate_time_constant = 0.05;    // s
  double thrust_time_constant = 0.04;  // s

  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  double thrust = 9.81;
  Eigen::Vector3d a = Eigen::Vector3d::Zero();

  Estimate Measured() const { return {p, v, q, a}; }

  /// Moves on by 5 ms with the setpoint sent now.
  void Step(const Setpoint& setpoint) {
    for (int ms = 0; ms < 5; ++ms) {
      pipe_.push_back(setpoint);
      while (static_cast<int>(pipe_.size()) > latency_ms + 1) pipe_.pop_front();
      StepMillisecond(pipe_.front());
    }
  }

 private:
  void StepMillisecond(const Setpoint& s) {
    const double dt = 1e-3;
    Eigen::Quaterniond error = q.conjugate() * s.R_WB;
    if (error.w() < 0.0) error.coeffs() *= -1.0;
    const Eigen::Vector3d wanted =
        (2.0 * attitude_gain * error.vec() + s.w_WB_B).cwiseMax(-4.0).cwiseMin(4.0);
    w += dt / rate_time_constant * (wanted - w);
    thrust += dt / thrust_time_constant * (s.thrust - thrust);
    const double given = thrust * (1.0 + thrust_error + thrust_curve * (thrust / 9.81 - 1.0));
    a = q * Eigen::Vector3d(0, 0, given / mass_factor) - drag * (v - wind) -
        Eigen::Vector3d(0, 0, 9.81);
    p += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
    const double angle = w.norm() * dt;
    if (angle > 0.0) q = (q * Eigen::AngleAxisd(angle, w.normalized())).normalized();
  }

  std::deque<Setpoint> pipe_;
};

}  // namespace chase::control::test
