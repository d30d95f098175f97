#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/rotation.h"

namespace chase::math {
namespace {

Eigen::Vector3d Random3(std::mt19937_64& g, double scale) {
  std::uniform_real_distribution<double> u(-scale, scale);
  return {u(g), u(g), u(g)};
}

TEST(Angles, WrapAndUnwrap) {
  EXPECT_NEAR(WrapAngle(3.0 * M_PI), M_PI, 1e-12);
  EXPECT_NEAR(WrapAngle(-M_PI), M_PI, 1e-12);
  EXPECT_NEAR(UnwrapAngle(-3.1, 3.1), 2.0 * M_PI - 3.1, 1e-12);
  EXPECT_NEAR(UnwrapAngle(0.1, 20.0 * M_PI), 20.0 * M_PI + 0.1, 1e-12);
}

TEST(Rotation, ZAxisAndYawAreKept) {
  std::mt19937_64 g(1);
  for (int i = 0; i < 200; ++i) {
    Eigen::Vector3d z = Random3(g, 0.7);
    z.z() = 1.0;
    const double yaw = Random3(g, M_PI).x();
    const Eigen::Quaterniond q = FromZAxisAndYaw(z, yaw);
    EXPECT_LT((q * Eigen::Vector3d::UnitZ() - z.normalized()).norm(), 1e-12);
    const Eigen::Vector3d x = q * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d heading(std::cos(yaw), std::sin(yaw), 0.0);
    EXPECT_GT(x.dot(heading), 0.0);
    EXPECT_NEAR((q * Eigen::Vector3d::UnitY()).dot(heading), 0.0, 1e-12);
  }
  EXPECT_NEAR(Yaw(FromYaw(1.3)), 1.3, 1e-12);
}

TEST(Rotation, DegenerateZAxisGivesLevelFlight) {
  EXPECT_NEAR(Yaw(FromZAxisAndYaw(Eigen::Vector3d::Zero(), 0.7)), 0.7, 1e-12);
  EXPECT_NEAR(Yaw(FromZAxisAndYaw(Eigen::Vector3d::UnitX(), 0.0)), 0.0, 1e-12);
}

TEST(Rotation, ExpAndLogAreInverse) {
  std::mt19937_64 g(2);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d w = Random3(g, 1.7) * (i % 3 == 0 ? 1e-7 : 1.0);
    EXPECT_LT((LogSO3(ExpSO3(w)) - w).norm(), 1e-12 + 1e-9 * w.norm());
    const Eigen::AngleAxisd reference(w.norm(), w.normalized());
    EXPECT_LT((ExpSO3(w).toRotationMatrix() - reference.toRotationMatrix()).norm(), 1e-12);
  }
}

TEST(Rotation, RightJacobianIsTheDerivative) {
  std::mt19937_64 g(3);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d w = Random3(g, 1.5), d = Random3(g, 1e-6);
    const Eigen::Vector3d moved = LogSO3(ExpSO3(w).conjugate() * ExpSO3(w + d));
    EXPECT_LT((moved - RightJacobianSO3(w) * d).norm(), 1e-11);
  }
}

TEST(Gaussian, ACovarianceHasNoNegativeEigenvalue) {
  std::mt19937_64 g(7);
  EXPECT_TRUE(IsCovariance(Eigen::Matrix3d::Zero()));
  EXPECT_FALSE(IsCovariance(Eigen::Matrix3d::Constant(std::nan(""))));
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Matrix3d axes = ExpSO3(Random3(g, 1.5)).toRotationMatrix();
    const double scale = std::pow(10.0, 6.0 * Random3(g, 1.0).x());
    Eigen::Vector3d values = scale * Random3(g, 1.0).cwiseAbs();
    values.head(i % 3).setZero();  // of any rank
    const auto turned = [&] {
      return Eigen::Matrix3d(axes * values.asDiagonal() * axes.transpose());
    };
    EXPECT_TRUE(IsCovariance(turned())) << values.transpose();
    Eigen::Matrix3d askew = turned();
    askew(0, 1) += 1e-6 * scale;
    EXPECT_FALSE(IsCovariance(askew));
    values[0] = -1e-9 * values.cwiseAbs().maxCoeff();
    EXPECT_FALSE(IsCovariance(turned())) << values.transpose();
  }
}

TEST(Gaussian, LogDensityIntegratesToOne) {
  Gaussian3 gaussian;
  gaussian.mean = {0.3, -0.2, 0.1};
  gaussian.covariance << 0.5, 0.1, 0.05, 0.1, 0.4, 0.0, 0.05, 0.0, 0.3;
  double sum = 0.0;
  const double h = 0.2;
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j)
      for (int k = -20; k <= 20; ++k)
        sum += std::exp(LogDensity(gaussian, Eigen::Vector3d(i, j, k) * h)) * h * h * h;
  EXPECT_NEAR(sum, 1.0, 1e-3);
}

TEST(Gaussian, ContourPointsLieOnTheContour) {
  Gaussian3 gaussian;
  gaussian.covariance << 0.5, 0.1, 0.0, 0.1, 0.4, 0.0, 0.0, 0.0, 0.3;
  const auto points = ContourPoints(gaussian, 2.0, 5);
  ASSERT_EQ(points.size(), 5u);
  EXPECT_EQ(points[0], gaussian.mean);
  for (size_t i = 1; i < 5; ++i) EXPECT_NEAR(SquaredMahalanobis(gaussian, points[i]), 4.0, 1e-9);
}

TEST(Gaussian, BadCovarianceIsGuarded) {
  Gaussian3 gaussian;
  gaussian.covariance = -Eigen::Matrix3d::Identity();
  EXPECT_EQ(LogDensity(gaussian, Eigen::Vector3d::Zero()), -INFINITY);
  EXPECT_EQ(ContourPoints(gaussian, 1.0, 3).size(), 3u);
  const Eigen::Matrix3d mended = MadePositiveDefinite(gaussian.covariance, 1e-4);
  EXPECT_NEAR(mended(0, 0), 1e-4, 1e-15);
}

}  // namespace
}  // namespace chase::math
