#include "deploy/calibrate/lidar_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::calibrate {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Which points are the board's: ever nearer to its plane, ever farther inside its outline.
struct Gate {
  double off, margin;  // m
};
constexpr Gate kGates[] = {{0.40, -0.20}, {0.20, -0.05}, {0.10, 0.02}, {0.08, 0.03}, {0.08, 0.03}};
constexpr double kHuber = 0.03;           // m: 1.5 of a VLP-16's standard deviations
constexpr std::size_t kLeastPoints = 20;  // of a plane that counts
constexpr double kLeastSpread =
    0.05;  // of the normals' least variance: 3 directions 13 degrees apart
constexpr int kSteps = 10;

std::vector<Vector3d> OnBoard(const Plane& plane, const Isometry3d& X_CL, const Gate& gate) {
  const Isometry3d X_PL = plane.X_CP.inverse() * X_CL;
  std::vector<Vector3d> found;
  for (const Vector3d& p_L : plane.points) {
    const Vector3d p = X_PL * p_L;
    const bool inside = p.x() > gate.margin && p.x() < plane.size.x() - gate.margin &&
                        p.y() > gate.margin && p.y() < plane.size.y() - gate.margin;
    if (inside && std::abs(p.z()) < gate.off) found.push_back(p_L);
  }
  return found;
}

struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double squares = 0.0;
  long n = 0;
};

/// Residual n . (X_CL p - o) and its derivative by a shift and a rotation, both in C.
Normal Linearised(const std::vector<Plane>& planes, const LidarFit& fit) {
  Normal sum;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const Vector3d n = planes[k].X_CP.linear().col(2), o = planes[k].X_CP.translation();
    for (const Vector3d& p_L : fit.used[k]) {
      const Vector3d turned = fit.X_CL.linear() * p_L;
      const double r = n.dot(turned + fit.X_CL.translation() - o);
      Vector6d J;
      J << n, turned.cross(n);
      const double weight = std::abs(r) > kHuber ? kHuber / std::abs(r) : 1.0;
      sum.H += weight * J * J.transpose();
      sum.g += weight * r * J;
      sum.squares += r * r;
      ++sum.n;
    }
  }
  return sum;
}

/// The least variance of the normals over all directions, 0 to 1/3.
double Spread(const std::vector<Plane>& planes, const LidarFit& fit) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double n = 0.0;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (fit.used[k].empty()) continue;
    const Vector3d normal = planes[k].X_CP.linear().col(2);
    scatter += normal * normal.transpose();
    ++n;
  }
  return n > 0.0 ? Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter / n).eigenvalues()[0]
                 : 0.0;
}

}  // namespace

LidarFit FitLidar(const std::vector<Plane>& planes, const Isometry3d& guess) {
  LidarFit fit;
  fit.X_CL = guess;
  for (const Gate& gate : kGates) {
    fit.used.clear();
    for (const Plane& plane : planes) {
      fit.used.push_back(OnBoard(plane, fit.X_CL, gate));
      if (fit.used.back().size() < kLeastPoints) fit.used.back().clear();
    }
    if (Spread(planes, fit) < kLeastSpread) {
      const auto seen = std::count_if(fit.used.begin(), fit.used.end(),
                                      [](const auto& points) { return !points.empty(); });
      fit.problem = "the LiDAR meets the board in " + std::to_string(seen) + " of " +
                    std::to_string(planes.size()) +
                    " pictures, and their normals do not span three directions; turn the board to "
                    "the left, to the right, up and down, nearer than 3 m";
      return fit;
    }
    for (int step = 0; step < kSteps; ++step) {
      const Normal sum = Linearised(planes, fit);
      const Vector6d change = -sum.H.ldlt().solve(sum.g);
      fit.X_CL.translation() += change.head<3>();
      const Vector3d turn = change.tail<3>();
      if (turn.norm() > 0.0)
        fit.X_CL.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * fit.X_CL.linear();
    }
  }
  const Normal sum = Linearised(planes, fit);
  const double variance = sum.squares / static_cast<double>(std::max(1L, sum.n - 6));
  const Vector6d sigmas = (variance * sum.H.inverse()).diagonal().cwiseSqrt();
  fit.rms = std::sqrt(variance);
  fit.position_sigma = sigmas.head<3>();
  fit.rotation_sigma = sigmas.tail<3>();
  return fit;
}

}  // namespace chase::calibrate
