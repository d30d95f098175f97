#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/world/separation.h"
#include "test/unit/separation_pairs.h"

namespace chase::world {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// ---- obstacles of the planner ----

/// Points of { x' R x <= 1 }, written with a Cholesky factor, stay within the body.
TEST(MakeBody, IsNoSmallerThanTheObstacle) {
  for (uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed, 17);
    const Matrix3d axes = RandomRotation(&random, seed % 2 == 0);
    const Vector3d half = RandomHalfSizes(&random);
    Obstacle o;
    o.shape = axes * half.cwiseAbs2().cwiseInverse().asDiagonal() * axes.transpose();
    o.shape = (0.5 * (o.shape + o.shape.transpose())).eval();
    o.center.start = 0.4;
    o.position_covariance = 0.01 * Matrix3d::Identity();
    o.velocity_covariance = 0.04 * Matrix3d::Identity();
    const Body body = MakeBody(o, 1.0, 2.5, 2.0);
    using Long = Eigen::Matrix<long double, 3, 3>;
    const Long L = o.shape.cast<long double>().llt().matrixL();
    for (int i = 0; i < 50; ++i) {
      const Vector3d n = RandomVector(&random, 1.0, 1.0, 1.0).normalized();
      const auto y = L.triangularView<Eigen::Lower>().solve(n.cast<long double>()).eval();
      const auto Qn = (body.shape.cast<long double>() * n.cast<long double>()).eval();
      const long double of_body = n.cast<long double>().dot(Qn);
      ASSERT_GE(of_body, y.squaredNorm()) << seed;
      ASSERT_LE(of_body, y.squaredNorm() * (1.0L + 1e-9L)) << seed;
    }
    const Vector3d n = Vector3d::UnitX();
    EXPECT_NEAR(Deviation(body, n, 0.4), std::sqrt(0.01 + 0.04 * 1.6 * 1.6), 1e-12);
  }
}

// Until it has been flown a mover's variance is no less than that of a body whose acceleration is
// white noise of 0.4 m^2/s^3, beside what the list's covariance holds beyond half a second of it.
TEST(MakeBody, AMoversChangesOfVelocityGrowWithTheCubeOfTheTime) {
  Obstacle o;
  o.center = Trajectory::Constant(Vector3d::Zero(), 9.8, 1.0);
  const Eigen::Matrix3d P = 0.01 * Eigen::Matrix3d::Identity();
  const auto listed = [](double density) {
    return Eigen::Matrix3d((0.04 + density / 3.0 * 0.5) *
                           Vector3d(1.0, 1.0, 0.0).asDiagonal().toDenseMatrix());
  };
  const double start = 10.0, duration = 2.5;
  for (const double flown : {0.1, 0.4, 1.3, 2.5, HUGE_VAL}) {
    o.position_covariance = P;
    o.velocity_covariance = listed(0.4);
    o.moving = true;
    const Body body = MakeBody(o, start, duration, 2.0, flown);
    o.moving = false;
    const Body stands = MakeBody(o, start, duration, 2.0, flown);
    for (double tau = 0.0; tau <= 1.0; tau += 0.01) {
      const double age = start + tau * duration - o.center.start;
      const double true_variance = 0.01 + 0.04 * age * age + 0.4 / 3.0 * age * age * age;
      const double is = std::pow(Deviation(body, Vector3d::UnitY(), tau), 2);
      const double without = std::pow(Deviation(stands, Vector3d::UnitY(), tau), 2);
      EXPECT_TRUE(is >= true_variance - 1e-12 || tau * duration > flown) << flown << " " << tau;
      EXPECT_GE(is, without - 1e-12);
      EXPECT_NEAR(without, 0.01 + listed(0.4)(1, 1) * age * age, 1e-12);
      EXPECT_NEAR(Deviation(body, Vector3d::UnitZ(), tau), 0.1, 1e-12);
    }
    const double end = std::min(flown, duration) / duration, at_end = 0.2 + end * duration;
    const double least = 0.01 + 0.04 * at_end * at_end + 0.4 / 3.0 * std::pow(at_end, 3);
    EXPECT_NEAR(std::pow(Deviation(body, Vector3d::UnitX(), end), 2),
                at_end > 0.5 ? least : 0.01 + listed(0.4)(0, 0) * at_end * at_end, 1e-12);
  }
}

TEST(MakeBody, WhatIsNoEllipsoidIsNeverKeptOff) {
  const Matrix3d shapes[] = {Matrix3d::Zero(), -Matrix3d::Identity(), Matrix3d::Ones(),
                             Vector3d(1.0, 1.0, -1.0).asDiagonal(),
                             Vector3d(1e12, 1.0, 1e-12).asDiagonal()};
  for (const Matrix3d& R : shapes) {
    Obstacle o;
    o.shape = R;
    Ball drone;
    drone.center << 100.0, 0.0, 0.0;
    const SeparationResult result = Separate(drone, nullptr, MakeBody(o, 0.0, 1.0, 1.0));
    EXPECT_NE(result.kept, Kept::kOff) << R;
  }
}

// ---- growing the axes is no enclosure ----

/// How far the ball of radius r about the ellipsoid x' R x <= 1 sticks out of the ellipsoid of
/// inverse shape `outer` in the worst of many directions, m.
double StickingOut(const Matrix3d& Q, double r, const Matrix3d& outer, Random* random) {
  double most = -HUGE_VAL;
  for (int i = 0; i < 2000; ++i) {
    Vector3d n;
    for (int a = 0; a < 3; ++a) n[a] = random->Gaussian();
    n.normalize();
    if (i % 2 == 0) n = Vector3d(n.x(), n.y(), 0.0).normalized();
    most = std::max(most, std::sqrt(n.dot(Q * n)) + r - std::sqrt(n.dot(outer * n)));
  }
  return most;
}

/// A piece of wall 2.5 m long, its half width given.
Body Wall(double width) {
  Body wall;
  wall.shape = Vector3d(1.25, width, 1.0).cwiseAbs2().asDiagonal();
  return wall;
}

TEST(EnclosingEllipsoid, GrownAxesDoNotHoldAWallAndABall) {
  Random random(1);
  for (double width : {0.01, 0.05, 0.1}) {
    const Matrix3d Q = Wall(width).shape;
    const Matrix3d grown = Inflated(Q.inverse(), 0.4).inverse();
    const double short_by = StickingOut(Q, 0.4, grown, &random);
    EXPECT_GT(short_by, 0.104) << width;
    EXPECT_LT(short_by, 0.146) << width;
  }
}

/// By Minkowski's inequality: a plan that enters an ellipsoid of grown axes touches for certain.
TEST(EnclosingEllipsoid, GrownAxesLieWithinTheSum) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed, 18);
    const Matrix3d R = RandomRotation(&random, seed % 2 == 0);
    const Vector3d half = RandomHalfSizes(&random);
    const Matrix3d Q = R * half.cwiseAbs2().asDiagonal() * R.transpose();
    const Matrix3d inverse = R * half.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
    const double r = random.Uniform(0.01, 1.0);
    const Matrix3d grown = Inflated(inverse, r).inverse();
    for (int i = 0; i < 200; ++i) {
      const Vector3d n = RandomVector(&random, 1.0, 1.0, 1.0).normalized();
      ASSERT_LE(std::sqrt(n.dot(grown * n)), std::sqrt(n.dot(Q * n)) + r + 1e-9) << seed;
    }
  }
}

/// A place that the grown ellipsoid calls free and where the drone's ball cuts into the wall.
TEST(EnclosingEllipsoid, APlaceOutsideTheGrownAxesCanTouch) {
  const Vector3d offset(1.15, 0.30, 0.0);
  const Body wall = Wall(0.01);
  const Matrix3d grown = Inflated(wall.shape.inverse(), 0.4);
  EXPECT_GT(offset.dot(grown * offset), 1.0);
  const Ball drone{Curve(offset.transpose()), math::Polynomial::Constant(1, 0.4)};
  EXPECT_EQ(Separate(drone, nullptr, wall).kept, Kept::kTouches);
  const Matrix3d enclosing = EnclosingEllipsoid(wall.shape, 0.4).inverse();
  EXPECT_LT(offset.dot(enclosing * offset), 1.0);
}

TEST(EnclosingEllipsoid, HoldsTheBallAboutEveryPoint) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed, 15);
    const Matrix3d R = RandomRotation(&random, seed % 2 == 0);
    const Vector3d half = RandomHalfSizes(&random);
    const Matrix3d Q = R * half.cwiseAbs2().asDiagonal() * R.transpose();
    const double r = random.Uniform(0.01, 1.0);
    const Matrix3d outer = EnclosingEllipsoid(Q, r), inverse = outer.inverse();
    EXPECT_LT(StickingOut(Q, r, outer, &random), 1e-9) << seed;
    for (int i = 0; i < 200; ++i) {
      Vector3d u, v;
      for (int a = 0; a < 3; ++a) u[a] = random.Gaussian(), v[a] = random.Gaussian();
      const Vector3d x = R * half.cwiseProduct(u.normalized()) + r * v.normalized();
      ASSERT_LT(x.dot(inverse * x), 1.0 + 1e-9) << seed;
    }
  }
}

TEST(EnclosingEllipsoid, HasTheLeastHorizontalProjection) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed, 16);
    const Vector3d half = RandomHalfSizes(&random);
    const Matrix3d R = RandomRotation(&random, true);
    const Matrix3d Q = R * half.cwiseAbs2().asDiagonal() * R.transpose();
    const double r = random.Uniform(0.01, 1.0);
    const auto area = [&](const Matrix3d& M) { return M.topLeftCorner<2, 2>().determinant(); };
    const double best = area(EnclosingEllipsoid(Q, r));
    for (double s = 1e-3; s < 1e4; s *= 1.02) {
      const Matrix3d other = (1.0 + s) * Q + (1.0 + 1.0 / s) * r * r * Matrix3d::Identity();
      ASSERT_LE(best, area(other) * (1.0 + 1e-9)) << seed << " s " << s;
    }
  }
}

/// Least distance to points of the solid, drawn and refined about the best.
double NearestByTrial(const Body& body, const Vector3d& offset, Random* random) {
  Vector3d n = Vector3d::UnitZ();
  double best = -HUGE_VAL;
  for (double spread = 1.0; spread > 1e-6; spread *= 0.9)
    for (int i = 0; i < 40; ++i) {
      const Vector3d x(random->Uniform(-1.0, 1.0), random->Uniform(-1.0, 1.0),
                       random->Uniform(-1.0, 1.0));
      const Vector3d m = (n + spread * x).normalized();
      const double distance = m.dot(offset - SupportPoint(body, m));  // no farther than the solid
      if (distance > best) best = distance, n = m;
    }
  return best;
}

TEST(Outwards, PointsAwayFromTheNearestPoint) {
  Random random(5);
  int outside = 0;
  for (int i = 0; i < 300; ++i) {
    Body body;
    body.kind = static_cast<Body::Kind>(i % 3);
    body.half =
        Vector3d(random.Uniform(0.05, 2.0), random.Uniform(0.05, 2.0), random.Uniform(0.05, 2.0));
    if (body.kind == Body::Kind::kCylinder) body.half.y() = body.half.x();
    const Eigen::Matrix3d R =
        Eigen::Quaterniond(random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0),
                           random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0))
            .normalized()
            .toRotationMatrix();
    body.shape = body.kind == Body::Kind::kEllipsoid
                     ? Eigen::Matrix3d(R * body.half.cwiseAbs2().asDiagonal() * R.transpose())
                     : R;
    const Vector3d offset(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3));
    const Vector3d n = Outwards(body, offset);
    EXPECT_NEAR(n.norm(), 1.0, 1e-9);
    const double distance = NearestByTrial(body, offset, &random);
    if (distance < 0.0) continue;
    ++outside;
    EXPECT_NEAR(n.dot(offset - SupportPoint(body, n)), distance, 1e-4) << i << ", kind " << i % 3;
  }
  EXPECT_GT(outside, 200);
}

// Off the corner of a box: along either face's normal alone it could come nearer to the edge.
TEST(Leaves, NoWayThatComesNearer) {
  Body body;
  body.kind = Body::Kind::kBox;
  body.half = Vector3d::Ones();
  Curve way = Curve::Zero(2, 3);
  way.row(0) << 1.2, 1.2, 0.0;
  way.row(1) << 0.1, -0.15, 0.0;
  EXPECT_FALSE(Leaves(way, body, 0.25));
  way.row(1) << 0.15, -0.1, 0.0;
  EXPECT_TRUE(Leaves(way, body, 0.25));
  body.center = Curve::Zero(2, 3);
  body.center.row(1) << 0.1, 0.1, 0.0;
  EXPECT_FALSE(Leaves(way, body, 0.25)) << "it comes after it";
}

/// However near the lower face of its slab is.
TEST(Leaves, TheGroundByItsTop) {
  Obstacle slab;
  slab.ground = true;
  slab.solid = Obstacle::Solid::kBox;
  slab.half = {8.0, 8.0, 0.3};
  slab.center = Trajectory::Constant(Vector3d::Zero(), 0.0, 1.0);
  const Body body = MakeBody(slab, 0.0, 1.0, 2.0);
  for (const double z : {-0.2, 0.1, 0.5}) {
    Curve way = Curve::Zero(2, 3);
    way.row(0) << 7.9, 0.0, z;
    way.row(1) << 0.0, 0.3, 0.2;
    EXPECT_TRUE(Leaves(way, body, 1.0)) << z;
    way.row(1) << 0.3, 0.0, -0.2;
    EXPECT_FALSE(Leaves(way, body, 1.0)) << z;
  }
}

}  // namespace
}  // namespace chase::world
