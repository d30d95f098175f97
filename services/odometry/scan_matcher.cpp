#include "services/odometry/scan_matcher.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

// A few rings on a post hold a direction squarely; that many planes may do so by their noise alone.
constexpr double kPostSupport = 4.0;

Pose Moved(const Pose& X, const Vector6d& step) {
  return {(math::ExpSO3(step.tail<3>()) * X.R).normalized(), X.p + step.head<3>()};
}

}  // namespace

double UncertaintyOf(const Matrix6d& covariance) {
  constexpr double kUsualRange = 8.0;  // m
  const double p2 = covariance.topLeftCorner<3, 3>().trace();
  const double theta2 = covariance.bottomRightCorner<3, 3>().trace();
  return std::sqrt(std::max(0.0, p2 + kUsualRange * kUsualRange * theta2));
}

/// Normal equations of one linearisation.
struct ScanMatcher::System {
  Matrix6d H = Matrix6d::Zero();  // only the lower half counts until all is added
  Vector6d b = Vector6d::Zero();
  double weight = 0.0;   // sum of the features' weights
  double squares = 0.0;  // weighted squares of the residuals
  double lever2 = 0.0;   // weighted squares of the distances to the body, m^2
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();  // H of the rotation, each feature per distance
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
  Matched(const std::vector<Eigen::Vector3f>& points, const SurfaceMap& map,
          const Eigen::Vector3f& eye)
      : points_(points), map_(map), eye_(eye), queries_(points.size()) {}

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
    map_.Find(std::move(left), eye_);
  }

 private:
  const std::vector<Eigen::Vector3f>& points_;
  const SurfaceMap& map_;
  const Eigen::Vector3f eye_;  // frame W, m: as predicted
  std::vector<Query> queries_;
};

/// The normal without its small parts along the axes. What is nearly parallel to an axis tells
/// nothing of it but by the noise of its normal, and a thousand such tell more than a few that face
/// it: a wall whose normals lean by 2 % turns each millimetre of its residuals into 5 cm of height.
Eigen::Vector3d ScanMatcher::Squarely(const Eigen::Vector3d& normal,
                                      const Eigen::Matrix3d& axes) const {
  const double least = std::cos(config_.slant * M_PI / 180.0);
  Eigen::Vector3d along = axes.transpose() * normal;
  for (int i = 0; i < 3; ++i)
    if (std::abs(along[i]) < least) along[i] = 0.0;
  return axes * along;
}

/// Of the kernel, for a surface that a ray meets at this cosine to its normal: what leaves a thin
/// one at a flat angle by more than noise can is of another, as the foot of a wall is that shares a
/// cell with the ground. A few dozen such take centimetres of height where little else holds it.
double ScanMatcher::Scale(double incidence, const Surface& surface) const {
  constexpr double kSigmas = 3.0, kLeast = 0.025;  // m: a cell is no better known
  const double along = config_.range_noise * incidence;
  const double noise = std::sqrt(along * along + static_cast<double>(surface.variance));
  return std::min(1.0, std::max(kLeast, kSigmas * noise) / config_.kernel);
}

ScanMatcher::System ScanMatcher::Linearise(const Pose& X_WB, double kernel, double gate,
                                           const Eigen::Matrix3d& axes, Matched* planes,
                                           Matched* posts, std::vector<Row>* rows) const {
  System system;
  const Eigen::Matrix3d R = X_WB.R.toRotationMatrix();
  const double noise2 = config_.range_noise * config_.range_noise;
  rows->clear();
  const auto add = [&](Matched* features, auto&& residual_of, double support) {
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
      const double incidence = J.head<3>().dot(rotated) / std::max(1e-3, rotated.norm());
      const Eigen::Vector3d n = Squarely(J.head<3>(), axes);
      J << n, rotated.cross(n);
      ++system.matched;
      if (std::abs(r) < kernel) ++system.inliers;
      const double own = Scale(incidence, *surface) * kernel, k2 = own * own;
      const double robust = k2 / (k2 + r * r);
      const double trust = noise2 / (noise2 + static_cast<double>(surface->variance));
      const double w = trust * robust * robust;
      const double range2 = std::max(rotated.squaredNorm(), 1e-6);
      system.Add(r, w, J, range2);
      J.tail<3>() /= std::sqrt(range2);
      system.turns += w * J.tail<3>() * J.tail<3>().transpose();
      rows->push_back({J.cast<float>(), static_cast<float>(support * w)});
    }
  };
  add(
      planes, [](const auto&... of) { return PlaneResidual(of...); }, 1.0);
  add(
      posts, [](const auto&... of) { return PostResidual(of...); }, kPostSupport);
  system.H = system.H.selfadjointView<Eigen::Lower>();
  return system;
}

void ScanMatcher::Analyse(const System& system, const std::vector<Row>& rows,
                          const Matrix6d& unknown_before, MatchResult* result) const {
  result->view = std::sqrt(std::max(system.lever2 / system.weight, 1e-6));
  result->known.resize(6, 0);
  double least = std::numeric_limits<double>::max();
  for (const int block : {0, 3}) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
        block == 0 ? Eigen::Matrix3d(system.H.topLeftCorner<3, 3>()) : system.turns);
    Eigen::Matrix3d directions = eigen.eigenvectors();
    int unknown = 0;  // those of least support come first
    for (int i = 0; i < 3; ++i) {
      Vector6d direction = Vector6d::Zero();
      direction.segment<3>(block) = directions.col(i);
      const double support = Support(rows, direction, eigen.eigenvalues()[i], system.weight);
      if (support < least) least = support, result->weakest = direction;
      if (support < config_.min_support) directions.col(i).swap(directions.col(unknown++));
    }
    KeepUnknown(unknown_before.block<3, 3>(block, block), unknown, &directions);
    for (int i = unknown; i < 3; ++i) {
      result->known.conservativeResize(6, result->known.cols() + 1);
      result->known.rightCols<1>().setZero();
      result->known.rightCols<1>().segment<3>(block) = directions.col(i);
    }
  }
}

/// Noise turns the unknown directions from sweep to sweep, and each turn would seem to tell a
/// little of them: those that are nearly the ones before stay these. The first `unknown` of
/// `directions` are unknown; `before` is the projector on those before.
void ScanMatcher::KeepUnknown(const Eigen::Matrix3d& before, int unknown,
                              Eigen::Matrix3d* directions) const {
  if (unknown == 0 || unknown == 3 || std::lround(before.trace()) != unknown) return;
  const Eigen::MatrixXd now = directions->leftCols(unknown);
  if ((now - before * now).norm() > std::cos(config_.slant * M_PI / 180.0)) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(-before);
  *directions = eigen.eigenvectors();
}

/// Features that hold a direction, each counted by how squarely it does. A surface that is nearly
/// parallel to the direction, or to the way on which a rotation takes it, seems to hold it, but
/// only by the noise of its normal. `squares`: what all rows of weight `weight` give along it;
/// where that is plenty, a lower bound will do.
double ScanMatcher::Support(const std::vector<Row>& rows, const Vector6d& direction, double squares,
                            double weight) const {
  const double least = std::cos(config_.slant * M_PI / 180.0);
  const double bound = squares - least * least * weight;
  if (bound > config_.min_support) return bound;
  const Eigen::Matrix<float, 6, 1> d = direction.cast<float>();
  double support = 0.0;
  for (const Row& row : rows) {
    const double along = static_cast<double>(std::abs(d.dot(row.J)));
    if (along > least) support += static_cast<double>(row.weight) * std::min(1.0, along);
  }
  return support;
}

/// Variance of a residual of weight 1 [m^2].
double ScanMatcher::Sigma2(const System& system) const {
  return std::max(system.squares / system.weight, std::pow(config_.range_noise, 2));
}

MatchResult ScanMatcher::Match(const Features& features, const SurfaceMap& planes,
                               const SurfaceMap& posts, const Pose& predicted,
                               const Matrix6d& covariance, const Matrix6d& unknown_before) const {
  MatchResult result;
  result.X_WB = predicted;
  result.gate = std::clamp(config_.least_gate + 3.0 * UncertaintyOf(covariance), config_.least_gate,
                           config_.gate);
  double kernel = std::max(config_.kernel, result.gate);
  const Eigen::Vector3f eye = (predicted * features.eye.cast<double>()).cast<float>();
  Matched matched_planes(features.planes, planes, eye), matched_posts(features.posts, posts, eye);
  System system;
  Pose alone;  // by the sweep alone
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  std::vector<Row> rows;
  rows.reserve(features.planes.size() + features.posts.size());
  for (int i = 0; i < config_.max_iterations; ++i) {
    system =
        Linearise(result.X_WB, kernel, result.gate, axes, &matched_planes, &matched_posts, &rows);
    axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
               Eigen::Matrix3d(system.H.topLeftCorner<3, 3>()))
               .eigenvectors();
    result.iterations = i + 1;
    if (system.weight < 1e-6) return result;
    Analyse(system, rows, unknown_before, &result);
    // The step within the span of the known directions.
    const auto& V = result.known;
    if (V.cols() == 0) return result;
    const Eigen::MatrixXd H = V.transpose() * system.H * V;
    const Eigen::VectorXd b = V.transpose() * system.b;
    alone = Moved(result.X_WB, V * H.ldlt().solve(b));
    Vector6d off;
    off << result.X_WB.p - predicted.p, math::LogSO3(result.X_WB.R * predicted.R.conjugate());
    const Eigen::MatrixXd prior = Sigma2(system) * (V.transpose() * covariance * V).inverse();
    const Vector6d step = V * (H + prior).ldlt().solve(b - prior * (V.transpose() * off));
    if (!step.allFinite()) return result;
    result.X_WB = Moved(result.X_WB, step);
    const bool settled = step.head<3>().norm() < 1e-3 && step.tail<3>().norm() < 1e-4;
    if (settled && kernel <= config_.kernel) break;
    kernel = std::max(config_.kernel, 0.5 * kernel);
  }
  if (!alone.p.allFinite()) return result;
  result.X_WB = alone;
  result.rms = std::sqrt(system.squares / system.weight);
  result.fit = static_cast<double>(system.inliers) / std::max(system.matched, 1);
  result.unmapped = 1.0 - static_cast<double>(system.matched) / std::max(system.total, 1);
  result.information = system.H / Sigma2(system);
  result.misfit = result.fit < config_.min_fit;
  result.valid = !result.misfit;
  return result;
}

}  // namespace chase::odometry
