#include "test/unit/odometry_synthetic.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/rotation.h"

namespace chase::odometry::test {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGravity = 9.81;
constexpr double kRamp = 2.0;  // s

/// 0 before 0, 1 after 1, with two continuous derivatives.
double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

double CastPillar(const Hall::Pillar& pillar, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& direction) {
  const Eigen::Vector2d o = from.head<2>() - pillar.center, d = direction.head<2>();
  const double a = d.squaredNorm(), b = o.dot(d);
  const double c = o.squaredNorm() - pillar.radius * pillar.radius;
  const double discriminant = b * b - a * c;
  if (a < 1e-12 || discriminant < 0.0) return kInfinity;
  const double s = (-b - std::sqrt(discriminant)) / a;
  return s > 0.0 ? s : kInfinity;
}

}  // namespace

double Hall::Cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  double nearest = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    if ((ends_open && axis == 1) || std::abs(direction[axis]) < 1e-12) continue;
    const double wall = direction[axis] > 0.0 ? max[axis] : min[axis];
    const double s = (wall - from[axis]) / direction[axis];
    if (s > 0.0) nearest = std::min(nearest, s);
  }
  if (!ends_open)
    for (const Pillar& pillar : pillars)
      nearest = std::min(nearest, CastPillar(pillar, from, direction));
  return nearest;
}

Pose Flight::X_WB(double t) const {
  const double s = std::max(0.0, t - rest);
  const double blend = SmoothStep(s / kRamp);
  Eigen::Vector3d p = start + t * slide;
  for (int i = 0; i < 3; ++i) p[i] += blend * amplitude[i] * std::sin(rate[i] * s);
  p.z() += climb * blend;
  const double yaw = blend * yaw_amplitude * std::sin(yaw_rate * s);
  const double roll = blend * tilt_amplitude * std::sin(tilt_rate * s);
  const double pitch = blend * tilt_amplitude * std::sin(1.3 * tilt_rate * s + 0.5);
  return {math::FromYaw(yaw) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()),
          p};
}

Eigen::Vector3d Flight::Velocity(double t) const {
  constexpr double h = 1e-4;
  return (X_WB(t + h).p - X_WB(t - h).p) / (2.0 * h);
}

Flight Flight::AtRest() {
  Flight flight;
  flight.rest = 1e9;
  return flight;
}

Flight Flight::Aggressive() {
  Flight flight;
  flight.amplitude = {1.8, 4.0, 0.9};
  flight.rate = {1.3, 0.7, 3.0};  // climbs of 2.7 m/s
  flight.climb = 1.7;
  flight.yaw_rate = 0.8;
  flight.tilt_amplitude = 35.0 * M_PI / 180.0;
  flight.tilt_rate = 2.5;
  return flight;
}

Sweep Scan(const Hall& hall, const std::function<Pose(double)>& X_WL, double start,
           const SensorModel& model, Noise* noise) {
  Sweep sweep;
  sweep.start = start;
  for (int k = 0; k < model.azimuths; ++k) {
    const double t = 0.1 * k / model.azimuths;
    const Pose X = X_WL(start + t);
    const double azimuth = -2.0 * M_PI * k / model.azimuths;
    for (int ring = 0; ring < 16; ++ring) {
      const double elevation = (-15.0 + 2.0 * ring) * M_PI / 180.0;
      const Eigen::Vector3d d(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double range = hall.Cast(X.p, X.R * d) + noise->Gauss(model.range_noise);
      if (!(range < 100.0) || noise->Uniform() < model.dropout) continue;
      sweep.points.push_back(
          {(range * d).cast<float>(), static_cast<float>(t), 100, static_cast<uint8_t>(ring)});
    }
  }
  return sweep;
}

ImuSample Measure(const Flight& flight, double t, const SensorModel& model, Noise* noise) {
  constexpr double h = 1e-4;
  const Pose before = flight.X_WB(t - h), now = flight.X_WB(t), after = flight.X_WB(t + h);
  const Eigen::Vector3d a = (after.p - 2.0 * now.p + before.p) / (h * h);
  const Eigen::Vector3d force = a + Eigen::Vector3d(0.0, 0.0, kGravity);
  ImuSample imu;
  imu.t = t;
  imu.accel = now.R.conjugate() * force + model.accel_bias + noise->Vector(model.accel_noise);
  imu.gyro = math::LogSO3(before.R.conjugate() * after.R) / (2.0 * h) + model.gyro_bias +
             noise->Vector(model.gyro_noise);
  return imu;
}

}  // namespace chase::odometry::test
