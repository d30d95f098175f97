#include "common/bus/convert.h"

#include <algorithm>
#include <cmath>

namespace chase::bus {

int64_t Utime(double seconds, int64_t origin) {
  return origin + static_cast<int64_t>(std::llround(seconds * 1e6));
}

world::Trajectory FromMessage(const polynomial_t& m, int64_t origin) {
  world::Trajectory trajectory{Seconds(m.utime, origin), m.duration,
                               Eigen::MatrixXd::Zero(m.n_coefficients / 3, 3)};
  // Whole rows: tools also read messages that no node would take.
  for (int i = 0; i < m.n_coefficients / 3 * 3; ++i)
    trajectory.coefficients(i / 3, i % 3) = m.coefficients[static_cast<std::size_t>(i)];
  return trajectory;
}

polynomial_t ToMessage(const world::Trajectory& trajectory, int64_t origin) {
  polynomial_t m{};
  m.utime = Utime(trajectory.start, origin);
  m.duration = trajectory.duration;
  m.n_coefficients = 3 * (trajectory.degree() + 1);
  for (int i = 0; i < m.n_coefficients; ++i)
    m.coefficients.push_back(trajectory.coefficients(i / 3, i % 3));
  return m;
}

world::Obstacle FromMessage(const obstacle_t& m, int64_t origin) {
  world::Obstacle o;
  o.id = m.id;
  o.moving = m.kind == obstacle_t::MOVING;
  o.ground = m.kind == obstacle_t::GROUND;
  o.center = FromMessage(m.center, origin);
  o.shape = ToSymmetric(m.shape);
  o.solid = static_cast<world::Obstacle::Solid>(m.solid);
  o.half = ToVector(m.half);
  if (m.solid != obstacle_t::ELLIPSOID) o.axes = ToQuaternion(m.orientation).normalized();
  o.position_covariance = ToSymmetric(m.position_covariance);
  o.velocity_covariance = ToSymmetric(m.velocity_covariance);
  o.existence = m.existence;
  return o;
}

obstacle_t ToMessage(const world::Obstacle& o, int64_t origin) {
  obstacle_t m{};
  m.id = o.id;
  m.kind = o.moving ? obstacle_t::MOVING : o.ground ? obstacle_t::GROUND : obstacle_t::STATIC;
  m.center = ToMessage(o.center, origin);
  Set(m.shape, o.shape);
  m.solid = static_cast<int8_t>(o.solid);
  Set(m.half, o.half);
  Set(m.orientation, o.axes);
  Set(m.position_covariance, o.position_covariance);
  Set(m.velocity_covariance, o.velocity_covariance);
  m.existence = o.existence;
  return m;
}

world::Geofence FromMessage(const geofence_t& m, const Eigen::Vector3d& home) {
  world::Geofence fence;
  for (std::size_t i = 0; i + 1 < m.corners.size(); i += 2)
    fence.polygon.emplace_back(m.corners[i] - home.x(), m.corners[i + 1] - home.y());
  fence.floor = m.floor - home.z();
  fence.ceiling = m.ceiling - home.z();
  return fence;
}

void Set(double (&out)[3], const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) out[i] = v[i];
}

void Set(double (&out)[4], const Eigen::Quaterniond& q) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

Eigen::Matrix3d ToSymmetric(const double (&m)[6]) {
  Eigen::Matrix3d symmetric;
  symmetric << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
  return symmetric;
}

void Set(double (&out)[6], const Eigen::Matrix3d& m) {
  const double entries[6] = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
  std::copy(entries, entries + 6, out);
}

Eigen::Matrix3d ToMatrix(const double (&m)[9]) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m);
}

void Set(double (&out)[9], const Eigen::Matrix3d& m) {
  for (int i = 0; i < 9; ++i) out[i] = m(i / 3, i % 3);
}

}  // namespace chase::bus
