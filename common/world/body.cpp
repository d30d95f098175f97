#include "common/world/body.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/bernstein.h"
#include "common/math/simplex.h"
#include "common/world/forecast.h"

namespace chase::world {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// With E = R Q - I, Q and R symmetric, R^(1/2) Q R^(1/2) - I has the eigenvalues of E. So Q is at
// least (1 - |E|) times the inverse of R.
Matrix3d InverseAbove(const Matrix3d& given) {
  const Matrix3d R = 0.5 * (given + given.transpose());
  const Eigen::LLT<Matrix3d> factors(R);
  const Matrix3d inverse = R.inverse(), Q = 0.5 * (inverse + inverse.transpose());
  const double rounding = 32.0 * 0x1p-53 * R.norm() * Q.norm();
  const double error = (R * Q - Matrix3d::Identity()).norm() + rounding;
  const bool usable = factors.info() == Eigen::Success && error < 0.1;
  return usable ? Matrix3d((1.0 + 2.0 * error) * Q)
                : Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

Body MakeBody(const Obstacle& obstacle, double start, double duration, double sigmas,
              double flown) {
  Body body;
  body.kind = obstacle.solid;
  body.ground = obstacle.ground && body.kind == Body::Kind::kBox;
  if (body.kind == Body::Kind::kEllipsoid)
    body.shape = InverseAbove(obstacle.shape);
  else
    body.shape = obstacle.axes.toRotationMatrix();
  Retime(obstacle, start, duration, sigmas, flown, &body);
  return body;
}

void Retime(const Obstacle& obstacle, double start, double duration, double sigmas, double flown,
            Body* body) {
  SetCurve(obstacle.center, start, duration, &body->center);
  body->half = obstacle.half;
  const bool known =
      obstacle.position_covariance.isZero(0.0) && obstacle.velocity_covariance.isZero(0.0);
  body->sigmas = known ? 0.0 : sigmas;
  // The age at tau is since + duration tau.
  const double since = start - obstacle.center.start;
  Matrix3d V = obstacle.velocity_covariance;
  if (obstacle.moving && !known)
    V.diagonal().head<2>().array() += UnlistedVariance(since + std::min(flown, duration));
  body->covariance[0] = obstacle.position_covariance + since * since * V;
  body->covariance[1] = 2.0 * since * duration * V;
  body->covariance[2] = duration * duration * V;
}

Vector3d SupportPoint(const Body& body, const Vector3d& n) {
  switch (body.kind) {
    case Body::Kind::kEllipsoid: {
      const Vector3d Qn = body.shape * n;
      const double squared = n.dot(Qn);
      return squared > 0.0 ? Vector3d(Qn / std::sqrt(squared)) : Vector3d::Zero();
    }
    case Body::Kind::kBox: {
      Vector3d x = body.half;
      for (int a = 0; a < 3; ++a)
        if (body.shape.col(a).dot(n) < 0.0) x[a] = -x[a];
      return body.shape * x;
    }
    case Body::Kind::kCylinder: {
      const double across = n.head<2>().norm();
      Vector3d x(0.0, 0.0, std::copysign(body.half.z(), n.z()));
      if (across > 0.0) x.head<2>() = body.half.x() / across * n.head<2>();
      return x;
    }
  }
  return Vector3d::Zero();
}

namespace {

Vector3d LevelNormal(const Body& body, const Vector3d& offset) {
  Vector3d n = offset;
  if (body.kind == Body::Kind::kEllipsoid) {
    n = body.shape.ldlt().solve(offset);
  } else {
    // The face that is the nearest of all, by what it is exceeded by.
    const bool box = body.kind == Body::Kind::kBox;
    const Vector3d x = box ? Vector3d(body.shape.transpose() * offset) : offset;
    const double across = box ? std::abs(x.x()) : x.head<2>().norm();
    const double beyond[3] = {across - body.half.x(),
                              box ? std::abs(x.y()) - body.half.y() : -HUGE_VAL,
                              std::abs(x.z()) - body.half.z()};
    const auto a = std::max_element(beyond, beyond + 3) - beyond;
    n = std::copysign(1.0, x[a]) * Vector3d::Unit(a);
    if (!box && a == 0) n << x.head<2>(), 0.0;
    if (box) n = body.shape * n;
  }
  const double length = n.norm();
  return length > 0.0 && std::isfinite(length) ? Vector3d(n / length) : Vector3d::UnitZ();
}

}  // namespace

Vector3d Outwards(const Body& body, const Vector3d& offset) {
  if (body.ground) return body.shape.col(2);
  constexpr int kSteps = 64;
  constexpr double kTouch = 1e-6, kExact = 1e-9;  // m
  const Vector3d level = LevelNormal(body, offset);
  math::Simplex from;  // offset less the solid
  Vector3d n = level;
  for (int i = 0; i < kSteps; ++i) {
    const Vector3d z = offset - SupportPoint(body, n);
    if (i > 0 && n.dot(z) > from.nearest().norm() - kExact) break;
    if (!z.allFinite() || !from.Add(z)) break;
    const double distance = from.nearest().norm();
    if (distance < kTouch) return level;
    n = from.nearest() / distance;
  }
  return n.dot(offset - SupportPoint(body, n)) > kTouch ? n : level;
}

bool Leaves(const Curve& curve, const Body& body, double until, double slack) {
  const Vector3d out = Outwards(body, (curve.row(0) - body.center.row(0)).transpose());
  const Eigen::Index n = std::max(curve.rows(), body.center.rows());
  math::Polynomial along = math::Polynomial::Zero(n);
  along.head(curve.rows()) = curve * out;
  along.head(body.center.rows()) -= body.center * out;
  math::Polynomial rate = math::Derivative(along);
  double scale = 1.0;  // of tau, to [0, until]
  for (Eigen::Index k = 0; k < rate.size(); ++k, scale *= until) rate[k] *= scale;
  return math::PowerToBernstein(rate).minCoeff() >= -slack;
}

double Deviation(const Body& body, const Vector3d& n, double tau) {
  double variance = 0.0;
  for (int k = 2; k >= 0; --k) variance = variance * tau + n.dot(body.covariance[k] * n);
  return std::sqrt(std::max(0.0, variance));
}

// The area of the projection goes with det((1 + s) Q + (1 + 1/s) r^2 I) of the horizontal block.
// Its derivative vanishes where 2 D s^3 + r^2 T s^2 - r^2 T s - 2 r^4 = 0, T the trace and D the
// determinant of the block: one change of sign, one positive root, and Newton's method comes down
// to it from any s above, where the cubic is positive and convex.
Matrix3d EnclosingEllipsoid(const Matrix3d& Q, double r) {
  const double T = Q(0, 0) + Q(1, 1), D = Q(0, 0) * Q(1, 1) - Q(0, 1) * Q(1, 0), rr = r * r;
  double s = 1.0 + 2.0 * rr / T;  // the cubic is positive here
  for (int i = 0; i < 60; ++i) {
    const double f = ((2.0 * D * s + rr * T) * s - rr * T) * s - 2.0 * rr * rr;
    const double slope = (6.0 * D * s + 2.0 * rr * T) * s - rr * T;
    const double next = s - f / slope;
    if (!(next < s) || !(next > 0.0)) break;
    s = next;
  }
  return (1.0 + s) * Q + (1.0 + 1.0 / s) * rr * Matrix3d::Identity();
}

}  // namespace chase::world
