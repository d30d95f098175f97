#include "services/odometry/scan_matcher.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::odometry {

/// Normal equations of one linearisation.
struct ScanMatcher::System {
  Matrix6d H = Matrix6d::Zero();  // only the lower half counts until all is added
  Vector6d b = Vector6d::Zero();
  double weight = 0.0;   // sum of the features' weights
  double squares = 0.0;  // weighted squares of the residuals
  double lever2 = 0.0;   // weighted squares of the distances to the body, m^2
  int matched = 0, inliers = 0, total = 0;

  void Add(double residual, double w, const Vector6d& J, double range2) {
    for (int i = 0; i < 6; ++i) H.col(i) += w * J[i] * J;
    b -= w * residual * J;
    weight += w;
    squares += w * residual * residual;
    lever2 += w * range2;
  }
};

/// Features and the surfaces near them: the map does not change during a match, so a feature that
/// stays within reach of the place where it was looked up keeps its surface.
class ScanMatcher::Matched {
 public:
  Matched(const std::vector<Eigen::Vector3f>& points, const SurfaceMap& map)
      : points_(points), map_(map), queries_(points.size()) {}

  size_t size() const { return points_.size(); }
  Eigen::Vector3d p_B(size_t i) const { return points_[i].cast<double>(); }
  const Surface* surface(size_t i) const { return queries_[i].surface; }

  void MoveTo(const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& p_WB) {
    std::vector<Query*> left;
    for (size_t i = 0; i < size(); ++i) {
      const Eigen::Vector3f p_W = (R_WB * p_B(i) + p_WB).cast<float>();
      if ((p_W - queries_[i].p).cwiseAbs().maxCoeff() < queries_[i].reach) continue;
      queries_[i].p = p_W;
      left.push_back(&queries_[i]);
    }
    map_.Find(std::move(left));
  }

 private:
  const std::vector<Eigen::Vector3f>& points_;
  const SurfaceMap& map_;
  std::vector<Query> queries_;
};

ScanMatcher::System ScanMatcher::Linearise(const Pose& X_WB, double kernel, double gate,
                                           Matched* planes, Matched* edges) const {
  System system;
  const Eigen::Matrix3d R = X_WB.R.toRotationMatrix();
  const double k2 = kernel * kernel;
  const double noise2 = config_.range_noise * config_.range_noise;
  const auto add = [&](Matched* features, auto&& residual_of, double weight) {
    features->MoveTo(R, X_WB.p);
    system.total += static_cast<int>(features->size());
    for (size_t i = 0; i < features->size(); ++i) {
      const Surface* surface = features->surface(i);
      if (!surface) continue;
      const Eigen::Vector3d rotated = R * features->p_B(i);
      const Eigen::Vector3d p_W = rotated + X_WB.p;
      Vector6d J;
      const double r = residual_of(p_W, rotated, *surface, &J);
      if (std::abs(r) > gate) continue;
      ++system.matched;
      if (std::abs(r) < kernel) ++system.inliers;
      const double robust = k2 / (k2 + r * r);
      const double trust = noise2 / (noise2 + static_cast<double>(surface->variance));
      system.Add(r, weight * trust * robust * robust, J, rotated.squaredNorm());
    }
  };
  add(
      planes, [](const auto&... of) { return PlaneResidual(of...); }, 1.0);
  add(
      edges, [](const auto&... of) { return EdgeResidual(of...); }, config_.edge_weight);
  system.H = system.H.selfadjointView<Eigen::Lower>();
  return system;
}

void ScanMatcher::Analyse(const System& system, MatchResult* result) const {
  // Rotations are scaled by the features' mean distance, so that all six directions compare.
  const double lever = std::sqrt(std::max(system.lever2 / system.weight, 1e-6));
  result->view = lever;
  Vector6d scale;
  scale << 1.0, 1.0, 1.0, 1.0 / lever, 1.0 / lever, 1.0 / lever;
  const Matrix6d normalised = scale.asDiagonal() * system.H * scale.asDiagonal() / system.weight;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(normalised);
  result->strength = eigen.eigenvalues();
  result->weakest = eigen.eigenvectors().col(0);
  int first = 0;
  while (first < 6 && result->strength[first] < config_.min_information) ++first;
  result->known = (scale.asDiagonal() * eigen.eigenvectors()).rightCols(6 - first);
  for (int i = 0; i < result->known.cols(); ++i) result->known.col(i).normalize();
}

MatchResult ScanMatcher::Match(const Features& features, const SurfaceMap& planes,
                               const SurfaceMap& edges, const Pose& predicted,
                               double uncertainty) const {
  MatchResult result;
  result.X_WB = predicted;
  const double gate =
      std::clamp(config_.least_gate + 3.0 * uncertainty, config_.least_gate, config_.gate);
  double kernel = std::max(config_.kernel, gate);
  Matched matched_planes(features.planes, planes), matched_edges(features.edges, edges);
  System system;
  for (int i = 0; i < config_.max_iterations; ++i) {
    system = Linearise(result.X_WB, kernel, gate, &matched_planes, &matched_edges);
    result.iterations = i + 1;
    if (system.matched < config_.min_features || system.weight < 1e-6) return result;
    Analyse(system, &result);
    // The step within the span of the known directions.
    const auto& V = result.known;
    if (V.cols() == 0) return result;
    const Eigen::MatrixXd reduced = V.transpose() * system.H * V;
    const Eigen::LDLT<Eigen::MatrixXd> solver(reduced);
    const Vector6d step = V * solver.solve(V.transpose() * system.b);
    if (!step.allFinite()) return result;
    result.X_WB.p += step.head<3>();
    result.X_WB.R = (math::ExpSO3(step.tail<3>()) * result.X_WB.R).normalized();
    const bool settled = step.head<3>().norm() < 1e-3 && step.tail<3>().norm() < 1e-4;
    if (settled && kernel <= config_.kernel) break;
    kernel = std::max(config_.kernel, 0.5 * kernel);
  }
  result.rms = std::sqrt(system.squares / system.weight);
  result.inliers = static_cast<double>(system.inliers) / std::max(system.total, 1);
  const double sigma2 = std::max(system.squares / system.weight, std::pow(config_.range_noise, 2));
  result.information = system.H / sigma2;
  result.valid = result.inliers >= config_.min_inliers;
  return result;
}

}  // namespace chase::odometry
