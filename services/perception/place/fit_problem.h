#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "services/perception/place/fit_residuals.h"
#include "services/perception/place/target_fit.h"

namespace chase::perception {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Gauss and Newton's equations around one y: information * step = -gradient. N: unknowns.
template <int N>
struct NormalEquations {
  double cost = 0.0;  ///< half the robust sum of squares
  Eigen::Matrix<double, N, 1> gradient = Eigen::Matrix<double, N, 1>::Zero();
  /// J' J with each row weighed by its loss's slope, as where the weights are held.
  Eigen::Matrix<double, N, N> information = Eigen::Matrix<double, N, N>::Zero();
};

/// The y of a target (fit_residuals.h).
Vector9d Unknowns(const TargetGaussian& target, const TargetShape& shape);

/// Signed distance of a point [m, times `scale`] from the surface of the target y of this kind
/// where it was at the point's time.
double SurfaceDistance(const TargetShape& shape, const TargetPoint& point, double scale,
                       const Vector9d& y, Vector9d* gradient);

/// The least squares problem of one FitInput over y (fit_residuals.h), of which the first
/// `unknowns()` are sought: prediction, edges, points, and a position where one is measured.
/// Single samples have Cauchy's loss, the prediction has none. Whichever solver is asked, it is
/// asked this.
class FitProblem {
 public:
  /// `input` must outlive it.
  FitProblem(const FitInput& input, const FitConfig& config);

  bool ok() const { return ok_; }  ///< the prediction's covariance has a root
  int unknowns() const { return config_.estimate_shape ? 9 : input_.shape.box() ? 7 : 6; }
  /// Where nothing was measured: the prediction, the size as it is known.
  Vector9d Start() const { return Unknowns(input_.prior, input_.shape); }

  /// Half the robust sum of squares.
  double Cost(const Vector9d& y) const;
  /// N: unknowns().
  template <int N>
  NormalEquations<N> Linearised(const Vector9d& y) const;

  /// What a solution means. `covariance` of y; where only some are sought their block.
  FitResult Read(const Vector9d& y, const Matrix9d& covariance, double cost) const;

 private:
  /// One sample of an edge and the pixels that go to one unit there: of the plan angle [rad] for
  /// left and right, of the slope for top and bottom.
  struct Edge {
    PlanRay ray;
    double px;
  };

  void AddEdges();
  void AddPosition();
  double Range(const Vector9d& y) const;
  double EdgeResidual(size_t side, const Edge& edge, double scale, const Vector9d& y,
                      Vector9d* gradient) const;
  template <class Sum>
  void Evaluate(const Vector9d& y, Sum* sum) const;
  template <class Sum>
  void EvaluatePrior(const Vector9d& y, Sum* sum) const;
  template <class Sum>
  void EvaluateEdges(const Vector9d& y, Sum* sum) const;
  template <class Sum>
  void EvaluatePoints(const Vector9d& y, Sum* sum) const;
  template <class Sum>
  void EvaluatePosition(const Vector9d& y, Sum* sum) const;
  std::vector<double> EdgeResiduals(size_t side, const Vector9d& y) const;
  std::vector<double> PointResiduals(const Vector9d& y) const;
  void ReadSides(const std::array<std::vector<double>, 4>& edges, FitResult* out) const;
  bool ReadEvidence(const std::array<std::vector<double>, 4>& edges,
                    const std::vector<double>& points, FitResult* out) const;

  const FitInput& input_;
  const FitConfig& config_;
  bool ok_ = false;
  double prior_range_ = 1.0;                 // m, from the camera in the plan view
  Matrix6d root_ = Matrix6d::Zero();         // of the prediction's information
  Matrix6d information_ = Matrix6d::Zero();  // of the prediction
  Eigen::Vector3d shape_information_ = Eigen::Vector3d::Zero();  // of yaw, half width, height
  std::array<std::vector<Edge>, 4> edges_;                       // by Side, those left out too
  std::optional<Eigen::Matrix3d> position_information_;          // of the measured position
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();           // measured, frame W, m
};

}  // namespace chase::perception
