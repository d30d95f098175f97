#include "common/world/trajectory.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "common/world/obstacle.h"
#include "common/world/rig.h"

namespace chase::world {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967295.0;
  }
  Vector3d Point(double size) {
    return {Uniform(-size, size), Uniform(-size, size), Uniform(-size, size)};
  }
  Trajectory Motion(int degree) {
    Trajectory t{Uniform(-3, 3), Uniform(0.5, 6.0), Eigen::MatrixXd::Zero(degree + 1, 3)};
    for (int k = 0; k <= degree; ++k) t.coefficients.row(k) = Point(4.0).transpose();
    return t;
  }
  Matrix3d Shape() {
    const Matrix3d Q = Eigen::HouseholderQR<Matrix3d>(Rows()).householderQ();
    const Vector3d axes(Uniform(0.2, 3.0), Uniform(0.2, 3.0), Uniform(0.2, 3.0));
    return Q * axes.cwiseAbs2().cwiseInverse().asDiagonal() * Q.transpose();
  }

 private:
  Matrix3d Rows() {
    Matrix3d m;
    for (int i = 0; i < 3; ++i) m.row(i) = Point(1.0).transpose();
    return m;
  }
  std::mt19937 engine_;
};

TEST(Trajectory, DerivativesAgreeWithFiniteDifferences) {
  Random random(11);
  for (int run = 0; run < 50; ++run) {
    const Trajectory x = random.Motion(run % 7);
    const double t = random.Uniform(x.start, x.end()), h = 1e-5;
    for (int order = 0; order < 4; ++order) {
      const Vector3d difference =
          (x.Derivative(order, t + h) - x.Derivative(order, t - h)) / (2.0 * h);
      const double scale = 1.0 + difference.norm();
      EXPECT_LT((difference - x.Derivative(order + 1, t)).norm(), 1e-5 * scale) << "run " << run;
    }
  }
}

TEST(Trajectory, ReparametrisingKeepsTheMotion) {
  Random random(12);
  for (int run = 0; run < 50; ++run) {
    const Trajectory x = random.Motion(run % 7);
    const Trajectory y = x.Reparametrised(random.Uniform(-2, 2), random.Uniform(0.5, 4));
    for (double t = y.start; t < y.end(); t += 0.1) {
      const double scale = 1.0 + x.Position(t).norm();
      EXPECT_LT((x.Position(t) - y.Position(t)).norm(), 1e-9 * scale);
      EXPECT_LT((x.Velocity(t) - y.Velocity(t)).norm(), 1e-8 * scale);
    }
  }
}

TEST(Obstacle, SegmentDistanceAgreesWithDenseSampling) {
  Random random(13);
  for (int run = 0; run < 200; ++run) {
    const Vector3d p = random.Point(4), q = random.Point(4), c = random.Point(2);
    const Matrix3d R = random.Shape();
    double brute = 1e300;
    for (int i = 0; i <= 2000; ++i) {
      const Vector3d d = p + (q - p) * (i / 2000.0) - c;
      brute = std::min(brute, d.dot(R * d));
    }
    const double closed = SegmentSquaredDistance(p, q, c, R);
    EXPECT_LE(closed, brute + 1e-12);
    EXPECT_NEAR(closed, brute, 1e-4 * (1.0 + brute)) << "run " << run;
  }
}

TEST(Obstacle, SegmentOfNoLengthIsThePoint) {
  const Vector3d p(1, 2, 3), c(0, 0, 1);
  EXPECT_DOUBLE_EQ(SegmentSquaredDistance(p, p, c, Matrix3d::Identity()), (p - c).squaredNorm());
}

TEST(Obstacle, InflatingAddsTheMarginToEveryAxis) {
  Random random(14);
  for (int run = 0; run < 20; ++run) {
    const Matrix3d R = random.Shape();
    const Eigen::Array3d before = Eigen::SelfAdjointEigenSolver<Matrix3d>(R).eigenvalues().array();
    const Eigen::Array3d after =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(Inflated(R, 0.3)).eigenvalues().array();
    EXPECT_TRUE((after.rsqrt() - before.rsqrt()).isApproxToConstant(0.3, 1e-9));
  }
}

TEST(Rig, CameraAxesAreARotationAndLookAheadAndDown) {
  Rig rig;
  rig.camera_pitch_deg = 20.0;
  const Matrix3d R = rig.R_BC();
  EXPECT_TRUE((R.transpose() * R).isIdentity(1e-12));
  EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
  const Vector3d ahead_and_down(std::cos(20 * M_PI / 180), 0.0, -std::sin(20 * M_PI / 180));
  const Eigen::Vector2d px = rig.Project(R.transpose() * ahead_and_down * 3.0);
  EXPECT_NEAR(px.x(), rig.center_u_px, 1e-9);
  EXPECT_NEAR(px.y(), rig.center_v_px, 1e-9);
  EXPECT_LT(rig.Project(R.transpose() * Vector3d(1.0, 0.2, 0.0)).x(), rig.center_u_px);
}

}  // namespace
}  // namespace chase::world
