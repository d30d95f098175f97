#pragma once

#include <cmath>

#include "common/math/rotation.h"
#include "common/world/random.h"
#include "logs/src/identification.h"
#include "services/control/tracking_law.h"
#include "test/unit/control_body.h"

/// Flights of a body whose parameters are known, for the tests of what a flight shows of its
/// vehicle.
namespace chase::logs::testing {

using control::test::Body;
using Eigen::Vector3d;
using world::Random;

constexpr double kStep = 0.005;  // s

/// A sum of two slow waves on each axis, so that velocity comes in all directions.
struct Course {
  Vector3d amplitude = {1.5, 1.2, 0.4}, phase = Vector3d::Zero();  // m, rad
  Vector3d omega = {1.0, 0.7, 1.3};                                // rad/s
  double yaw_rate = 0.2;                                           // rad/s

  control::Reference At(double t) const {
    control::Reference r;
    const Vector3d angle = omega * t + phase;
    const Vector3d sine = angle.array().sin(), cosine = angle.array().cos();
    const Vector3d first = amplitude.cwiseProduct(omega), second = first.cwiseProduct(omega);
    r.state.p = amplitude.cwiseProduct(sine);
    r.state.v = first.cwiseProduct(cosine);
    r.state.a = -second.cwiseProduct(sine);
    r.state.j = -second.cwiseProduct(omega).cwiseProduct(cosine);
    r.yaw = math::WrapAngle(yaw_rate * t);
    r.yaw_rate = yaw_rate;
    return r;
  }
};

/// What the world and the sensors add.
struct Errors {
  double gust = 0.0;                               // m/s, of 2 s
  Vector3d accel_bias = Vector3d::Zero();          // m/s^2
  double accel = 0.0, gyro = 0.0, velocity = 0.0;  // m/s^2, rad/s, m/s
};

inline Vector3d Noise(double sigma, Random* random) {
  const double x = random->Gaussian(), y = random->Gaussian(), z = random->Gaussian();
  return sigma * Vector3d(x, y, z);
}

/// It follows the course by control's law; `rate_share` of the rates fed forward reaches it.
inline FlightSamples Fly(Body body, const Course& course, const Errors& errors, uint64_t seed,
                         double seconds = 60.0, double rate_share = 1.0) {
  Random random(seed, 1);
  control::TrackingLaw law(control::ControlConfig{});
  const Vector3d wind = body.wind;
  Vector3d gust = Vector3d::Zero();
  FlightSamples flight;
  const control::Reference start = course.At(0.0);
  body.p = start.state.p, body.v = start.state.v;
  for (int i = 0; i * kStep < seconds; ++i) {
    const double t = i * kStep, keep = std::exp(-kStep / 2.0);
    gust = keep * gust + Noise(errors.gust * std::sqrt(1.0 - keep * keep), &random);
    body.wind = wind + gust;
    control::Estimate estimate = body.Measured();
    estimate.v_WB += Noise(errors.velocity, &random);
    const control::Setpoint s = law.Track(estimate, course.At(t), course.At(t + 0.02), kStep);
    const Vector3d force = body.q.conjugate() * (body.a + Vector3d(0, 0, 9.81));
    flight.motions.push_back({t, force + errors.accel_bias + Noise(errors.accel, &random),
                              body.w + Noise(errors.gyro, &random), estimate.v_WB, body.q,
                              errors.velocity * errors.velocity * Eigen::Matrix3d::Identity(), 0});
    flight.asked.push_back({t, s.R_WB, s.w_WB_B, s.thrust});
    body.Step({s.R_WB, rate_share * s.w_WB_B, s.thrust});
  }
  return flight;
}

}  // namespace chase::logs::testing
