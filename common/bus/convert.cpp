#include "common/bus/convert.h"

#include <cmath>

namespace chase::bus {

int64_t Utime(double seconds, int64_t origin) {
  return origin + static_cast<int64_t>(std::llround(seconds * 1e6));
}

world::Trajectory FromMessage(const polynomial_t& m, int64_t origin) {
  world::Trajectory trajectory{Seconds(m.utime, origin), m.duration,
                               Eigen::MatrixXd::Zero(m.n_coefficients / 3, 3)};
  for (int i = 0; i < m.n_coefficients; ++i)
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
  o.center = FromMessage(m.center, origin);
  o.shape << m.shape[0], m.shape[1], m.shape[2], m.shape[1], m.shape[3], m.shape[4], m.shape[2],
      m.shape[4], m.shape[5];
  o.position_variance = m.position_variance;
  o.velocity_variance = m.velocity_variance;
  return o;
}

obstacle_t ToMessage(const world::Obstacle& o, int64_t origin) {
  obstacle_t m{};
  m.id = o.id;
  m.kind = o.moving ? obstacle_t::MOVING : obstacle_t::STATIC;
  m.center = ToMessage(o.center, origin);
  const Eigen::Matrix3d& R = o.shape;
  const double shape[6] = {R(0, 0), R(0, 1), R(0, 2), R(1, 1), R(1, 2), R(2, 2)};
  for (int i = 0; i < 6; ++i) m.shape[i] = shape[i];
  m.position_variance = o.position_variance;
  m.velocity_variance = o.velocity_variance;
  return m;
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

Eigen::Matrix3d ToMatrix(const double (&m)[9]) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m);
}

void Set(double (&out)[9], const Eigen::Matrix3d& m) {
  for (int i = 0; i < 9; ++i) out[i] = m(i / 3, i % 3);
}

}  // namespace chase::bus
