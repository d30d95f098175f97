#include "common/math/gaussian.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace chase::math {

double SquaredMahalanobis(const Gaussian3& g, const Eigen::Vector3d& x) {
  const Eigen::LLT<Eigen::Matrix3d> llt(g.covariance);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return llt.matrixL().solve(x - g.mean).squaredNorm();
}

double LogDensity(const Gaussian3& g, const Eigen::Vector3d& x) {
  const Eigen::LLT<Eigen::Matrix3d> llt(g.covariance);
  if (llt.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const Eigen::Matrix3d L = llt.matrixL();
  const double log_det = L.diagonal().array().log().sum();
  const double squared = llt.matrixL().solve(x - g.mean).squaredNorm();
  return -0.5 * squared - log_det - 1.5 * std::log(2.0 * M_PI);
}

std::vector<Eigen::Vector3d> ContourPoints(const Gaussian3& g, double sigmas, int count) {
  std::vector<Eigen::Vector3d> points;
  if (count <= 0) return points;
  const Eigen::LLT<Eigen::Matrix2d> llt(g.covariance.topLeftCorner<2, 2>());
  const Eigen::Matrix2d L =
      llt.info() == Eigen::Success ? Eigen::Matrix2d(llt.matrixL()) : Eigen::Matrix2d::Zero();
  points.push_back(g.mean);
  for (int i = 1; i < count; ++i) {
    const double angle = 2.0 * M_PI * (i - 1) / (count - 1);
    const Eigen::Vector2d offset = L * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    points.push_back(g.mean + sigmas * Eigen::Vector3d(offset.x(), offset.y(), 0.0));
  }
  return points;
}

double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
}

bool IsCovariance(const Eigen::Matrix3d& m) {
  constexpr double kRounding = 1e-12;  // of the trace
  if (m.isZero(0.0)) return true;
  const double slack = kRounding * m.trace();
  if (!m.allFinite() || !((m - m.transpose()).cwiseAbs().maxCoeff() <= slack)) return false;
  const Eigen::LLT<Eigen::Matrix3d> llt(m + slack * Eigen::Matrix3d::Identity());
  return llt.info() == Eigen::Success;
}

Eigen::Matrix3d MadePositiveDefinite(const Eigen::Matrix3d& m, double floor) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (m + m.transpose()));
  const Eigen::Vector3d values = eigen.eigenvalues().cwiseMax(floor);
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace chase::math
