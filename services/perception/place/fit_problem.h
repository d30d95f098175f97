#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "services/perception/place/fit_residuals.h"
#include "services/perception/place/target_fit.h"

namespace chase::perception {

/// Gauss and Newton's equations around one y: information * step = -gradient.
struct NormalEquations {
  double cost = 0.0;  ///< half the robust sum of squares
  Vector7d gradient = Vector7d::Zero();
  /// J' J with each row weighed by its loss's slope, as where the weights are held.
  Matrix7d information = Matrix7d::Zero();

  void Add(double weight, const Residual& r) {
    const Vector7d weighed = weight * r.by_y;
    gradient += r.value * weighed;
    information.noalias() += weighed * r.by_y.transpose();
  }
};

/// The y of a target (fit_residuals.h).
Vector7d Unknowns(const TargetGaussian& target, const TargetShape& shape);

/// Signed distance of a point [m] from the surface of the target y where it was at the point's
/// time.
Residual SurfaceDistance(const TargetShape& shape, const TargetPoint& point, const Vector7d& y);

/// The least squares problem of one FitInput over y (fit_residuals.h): prediction, edges, points,
/// and a position where one is measured. Single samples have Cauchy's loss, the prediction has
/// none. Whichever solver is asked, it is asked this.
class FitProblem {
 public:
  /// `input` must outlive it.
  FitProblem(const FitInput& input, const FitConfig& config);

  bool ok() const { return ok_; }  ///< the prediction's covariance has a root
  /// Where nothing was measured: the prediction.
  Vector7d Start() const { return Unknowns(input_.prior, input_.shape); }
  NormalEquations Linearised(const Vector7d& y) const;
  /// What a solution means.
  FitResult Read(const Vector7d& y, const Matrix7d& covariance, double cost) const;

 private:
  /// One sample of an edge and the pixels that go to one unit there: of the plan angle [rad] for
  /// left and right, of the slope for top and bottom.
  struct Edge {
    PlanRay ray;
    double px;
  };

  void AddEdges();
  void AddPosition();
  double Range(const Vector7d& y) const;
  /// In px, at a range of 1 m.
  Residual EdgeResidual(size_t side, const Edge& edge, const Vector7d& y) const;
  void ReadSides(const std::array<std::vector<double>, 4>& edges, FitResult* out) const;
  bool ReadEvidence(const std::array<std::vector<double>, 4>& edges,
                    const std::vector<double>& points, FitResult* out) const;

  const FitInput& input_;
  const FitConfig& config_;
  const Solid solid_;
  bool ok_ = false;
  double prior_range_ = 1.0;                             // m, from the camera in the plan view
  Matrix6d root_ = Matrix6d::Zero();                     // of the prediction's information
  Matrix7d information_ = Matrix7d::Zero();              // of the prediction
  std::array<std::vector<Edge>, 4> edges_;               // by Side, those left out too
  std::optional<Eigen::Matrix3d> position_information_;  // of the measured position
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();   // measured, frame W, m
};

}  // namespace chase::perception
