#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/world/random.h"
#include "common/world/separation_check.h"

namespace chase::world {

/// A drone and a target as balls on random courses, and a random body near them.
struct SeparationPair {
  Ball drone, target;
  bool sight = false;  ///< the hull of both balls is asked, else the drone's only
  Body body;

  const Ball* second() const { return sight ? &target : nullptr; }
};

inline double ProvenRoom(const Separation& s, const Ball& drone, const Ball* target,
                         const Body& body) {
  SweptBall first(drone), second(target ? *target : drone);
  return ProvenRooms(s.normal, first.Over(s.from, s.to, body),
                     target ? &second.Over(s.from, s.to, body) : nullptr, body)
      .Least();
}

/// Of the whole horizon.
inline bool Certifies(const Certificate& certificate, const Ball& drone, const Ball* target,
                      const Body& body) {
  SweptBall first(drone), second(target ? *target : drone);
  return IsCertificate(certificate, 0.0, 1.0, &first, target ? &second : nullptr, body);
}

inline bool CertifiesExactly(const Certificate& certificate, const Ball& drone, const Ball* target,
                             const Body& body) {
  return IsCertificateExact(certificate, 0.0, 1.0, drone, target, body);
}

inline Eigen::Vector3d RandomVector(Random* random, double x, double y, double z) {
  const double a = random->Uniform(-x, x), b = random->Uniform(-y, y);
  return {a, b, random->Uniform(-z, z)};
}

inline Eigen::Matrix3d RandomRotation(Random* random, bool upright) {
  const double yaw = random->Uniform(-M_PI, M_PI);
  Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  if (!upright) {
    Eigen::Vector4d q;
    for (int i = 0; i < 4; ++i) q[i] = random->Gaussian();
    turn = Eigen::Quaterniond(q.normalized());
  }
  return turn.toRotationMatrix();
}

/// Pillars, walls (half widths 0.01 to 0.1 m, 1 to 3 m long) and lumps.
inline Eigen::Vector3d RandomHalfSizes(Random* random) {
  const double u = random->Uniform();
  if (u < 0.3) {
    const double a = random->Uniform(0.2, 0.5);
    return {a, a, random->Uniform(1.0, 2.0)};
  }
  if (u < 0.7)
    return {random->Uniform(0.5, 1.5), random->Uniform(0.01, 0.1), random->Uniform(0.5, 2.0)};
  return {random->Uniform(0.1, 1.0), random->Uniform(0.1, 1.0), random->Uniform(0.1, 1.0)};
}

inline void SetRandomUncertainty(Random* random, Body* body) {
  const double u = random->Uniform();
  if (u < 0.5) return;
  body->sigmas = random->Uniform(1.0, 3.0);
  for (int k = 0; k < 3; k += 2) {
    const Eigen::Matrix3d R =
        u < 0.85 ? Eigen::Matrix3d::Identity() : RandomRotation(random, false);
    Eigen::Vector3d deviation = Eigen::Vector3d::Constant(random->Uniform(0.01, 0.15));
    if (u >= 0.85)
      for (int a = 0; a < 3; ++a) deviation[a] = random->Uniform(0.01, 0.15);
    body->covariance[k] = R * deviation.cwiseAbs2().asDiagonal() * R.transpose();
    body->covariance[k] = (0.5 * (body->covariance[k] + body->covariance[k].transpose())).eval();
  }
}

/// Somewhere along the chase: within 1.5 m of the line of sight at some time.
inline Eigen::Vector3d RandomPlace(Random* random, const SeparationPair& pair) {
  const double tau = random->Uniform(), s = random->Uniform();
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), q = p;
  for (Eigen::Index k = 7; k-- > 0;) p = p * tau + pair.drone.center.row(k).transpose();
  for (Eigen::Index k = 3; k-- > 0;) q = q * tau + pair.target.center.row(k).transpose();
  return (1.0 - s) * p + s * q + RandomVector(random, 1.5, 1.5, 0.5);
}

inline Body RandomBody(Random* random, const Eigen::Vector3d& place) {
  Body body;
  body.kind = static_cast<Body::Kind>(random->Next() % 3);
  body.half = RandomHalfSizes(random);
  const Eigen::Matrix3d R = RandomRotation(random, random->Uniform() < 0.5);
  if (body.kind == Body::Kind::kBox) body.shape = R;
  if (body.kind == Body::Kind::kEllipsoid) {
    body.shape = R * body.half.cwiseAbs2().asDiagonal() * R.transpose();
    body.shape = (0.5 * (body.shape + body.shape.transpose())).eval();
  }
  if (body.kind == Body::Kind::kCylinder) body.half.y() = body.half.x();
  const int degree = static_cast<int>(random->Next() % 3);
  body.center = Curve::Zero(degree + 1, 3);
  body.center.row(0) = place.transpose();
  for (int k = 1; k <= degree; ++k)
    body.center.row(k) = RandomVector(random, 1.5, 1.5, 0.3).transpose();
  SetRandomUncertainty(random, &body);
  return body;
}

/// A chaser of degree 6, a target of degree 2, coordinates up to about 100 m.
inline SeparationPair RandomPair(Random* random) {
  SeparationPair pair;
  pair.target.center = Curve::Zero(3, 3);
  const Eigen::Vector3d origin = RandomVector(random, 100.0, 100.0, 5.0);
  pair.target.center.row(0) = origin.transpose();
  pair.target.center.row(1) = RandomVector(random, 4.0, 4.0, 0.2).transpose();
  pair.target.center.row(2) = RandomVector(random, 1.5, 1.5, 0.1).transpose();
  pair.drone.center = Curve::Zero(7, 3);
  pair.drone.center.topRows(3) = pair.target.center;
  pair.drone.center.row(0) += RandomVector(random, 3.0, 3.0, 1.0).transpose();
  for (int k = 1; k <= 6; ++k)
    pair.drone.center.row(k) += RandomVector(random, 0.8, 0.8, 0.2).transpose();
  pair.drone.radius = Eigen::Vector2d(random->Uniform(0.3, 0.5), random->Uniform(0.0, 0.15));
  pair.sight = random->Uniform() < 0.5;
  pair.target.radius = Eigen::Vector2d(0.0, 0.0);
  if (random->Uniform() < 0.5) pair.target.radius[0] = random->Uniform(0.0, 0.3);
  if (random->Uniform() < 0.2) pair.drone.radius.setZero();  // sight alone
  pair.body = RandomBody(random, RandomPlace(random, pair));
  return pair;
}

}  // namespace chase::world
