#pragma once

#include <vector>

#include "services/odometry/surface_map.h"
#include "services/odometry/sweep.h"

namespace chase::odometry {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

struct MatchConfig {
  int max_iterations = 8;
  double gate = 0.6;          ///< features farther from their surface are left out, m
  double least_gate = 0.15;   ///< the same where the prediction is certain, m
  double kernel = 0.07;       ///< scale of the robust kernel at the end, m
  double range_noise = 0.02;  ///< standard deviation of a residual, m
  double slant = 80.0;        ///< deg
  double min_support = 10.0;  ///< features
  double min_fit = 0.65;      ///< 1

  template <class V>
  void Visit(V& v) {
    v("max_iterations", max_iterations, "of Gauss-Newton");
    v("gate", gate, "features farther from their surface are left out, m");
    v("least_gate", least_gate, "the same where the prediction is certain, m");
    v("kernel", kernel, "largest scale of the robust kernel at the end, m");
    v("range_noise", range_noise, "smallest standard deviation of a residual, m");
    v("slant", slant, "a surface turned farther from a direction says nothing of it, deg");
    v("min_support", min_support, "features, at least, that must hold a direction");
    v("min_fit", min_fit, "least share of the matched features within the kernel");
  }
};

struct Features {
  std::vector<Eigen::Vector3f> planes, posts;     ///< frame B at the sweep's end, m
  Eigen::Vector3f eye = Eigen::Vector3f::Zero();  ///< where they were seen from, the same
};

struct MatchResult {
  bool valid = false;
  Pose X_WB;
  /// Orthonormal columns span the directions of (p, rotation error in W) that the sweep determines,
  /// each of a translation or of a rotation; the others keep the prediction's value in X_WB.
  Eigen::Matrix<double, 6, Eigen::Dynamic> known = Eigen::MatrixXd::Zero(6, 0);
  Matrix6d information = Matrix6d::Zero();  ///< inverse covariance of (p, rotation error in W)
  Vector6d weakest = Vector6d::Zero();      ///< direction of the least support
  double fit = 1.0;                         ///< share of the matched features within the kernel
  double unmapped = 1.0;                    ///< share of the features where the map knows nothing
  double nis = 0.0;                         ///< per direction, once a filter saw it
  double view = 0.0;                        ///< the features' usual distance, m
  double rms = 0.0;                         ///< of the inliers' residuals, m
  double gate = 0.0;                        ///< how far off a feature was still matched, m
  int iterations = 0;

  /// The sweep contradicts the map. One that finds no map where it looks is not valid either.
  bool misfit = false;

  bool degenerate() const { return valid && known.cols() < 6; }
};

/// Standard deviation of where points at a usual distance are, by the covariance of a pose [m].
double UncertaintyOf(const Matrix6d& covariance);

/// Residual of a feature against a surface and its derivative with respect to (p, rotation error in
/// W) where R_WB <- Exp(d_theta) R_WB. `rotated` is R_WB p_B.
inline double PlaneResidual(const Eigen::Vector3d& p_W, const Eigen::Vector3d& rotated,
                            const Surface& plane, Vector6d* jacobian) {
  const Eigen::Vector3d n = plane.direction.cast<double>();
  *jacobian << n, rotated.cross(n);
  return n.dot(p_W - plane.center.cast<double>());
}

inline double PostResidual(const Eigen::Vector3d& p_W, const Eigen::Vector3d& rotated,
                           const Surface& line, Vector6d* jacobian) {
  const Eigen::Vector3d u = line.direction.cast<double>();
  const Eigen::Vector3d d = p_W - line.center.cast<double>();
  const Eigen::Vector3d across = d - u * u.dot(d);
  const double distance = across.norm();
  const Eigen::Vector3d n = distance > 1e-9 ? across / distance : u.unitOrthogonal();
  *jacobian << n, rotated.cross(n);
  return distance;
}

/// Sweep against map: Gauss-Newton on the manifold over point-to-plane and point-to-line distances
/// with a Geman-McClure kernel that narrows, the more so the less noise explains. Zhang & Singh
/// 2014 (LOAM), eqs. (2) to (4). Directions are told known from unknown by what supports each,
/// translation and rotation apart, after Tuna et al. 2023 (X-ICP), section IV; the unknown ones are
/// left at the prediction. What fits is judged where sweep and prediction agree best: a few far
/// features that lie within the gate of a surface which is not theirs would by their lever turn the
/// sweep alone until they seem to fit.
class ScanMatcher {
 public:
  explicit ScanMatcher(const MatchConfig& config) : config_(config) {}

  /// `covariance`: of `predicted`, in (p, rotation error in W); narrows the gate. The result is
  /// what the sweep alone says. `unknown_before`: projector on the directions that the sweep before
  /// did not determine.
  MatchResult Match(const Features& features, const SurfaceMap& planes, const SurfaceMap& posts,
                    const Pose& predicted, const Matrix6d& covariance,
                    const Matrix6d& unknown_before = Matrix6d::Zero()) const;

 private:
  struct Row {                     // of the linearised problem
    Eigen::Matrix<float, 6, 1> J;  // the rotation's part per metre of distance
    float weight;                  // as a support of the directions that it holds
  };
  struct System;
  class Matched;
  System Linearise(const Pose& X_WB, double kernel, double gate, const Eigen::Matrix3d& axes,
                   Matched* planes, Matched* posts, std::vector<Row>* rows) const;
  double Scale(double incidence, const Surface& surface) const;
  Eigen::Vector3d Squarely(const Eigen::Vector3d& normal, const Eigen::Matrix3d& axes) const;
  void Analyse(const System& system, const std::vector<Row>& rows, const Matrix6d& unknown_before,
               MatchResult* result) const;
  void KeepUnknown(const Eigen::Matrix3d& before, int unknown, Eigen::Matrix3d* directions) const;
  double Sigma2(const System& system) const;
  double Support(const std::vector<Row>& rows, const Vector6d& direction, double squares,
                 double weight) const;

  MatchConfig config_;
};

}  // namespace chase::odometry
