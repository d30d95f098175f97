#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "services/perception/place/fit_residuals.h"
#include "services/perception/place/target_fit.h"

namespace chase::perception {

/// The y of a target (fit_residuals.h).
Vector7d Unknowns(const TargetGaussian& target, const TargetShape& shape);

/// Signed distance of a point [m] from the surface of the target y where it was at the point's
/// time.
template <class T>
T SurfaceDistance(const TargetShape& shape, const TargetPoint& point, const Unknown<T>& y) {
  const Solid solid{shape.box(), shape.size[0], shape.size[1]};
  return shape.sphere() ? SpherePointResidual(point.p_W, point.age, solid, y)
                        : PointResidual(point.p_W, point.age, solid, y);
}

/// The least squares problem of one FitInput over y (fit_residuals.h), as Ceres asks for it:
/// prediction, edges, points, and a position where one is measured, in standard deviations. Single
/// samples have Cauchy's loss, the prediction has none: a residual weighed by the loss's slope, and
/// one without derivatives for what that leaves of the loss, which is concave.
class FitProblem {
 public:
  /// `input` must outlive it.
  FitProblem(const FitInput& input, const FitConfig& config);

  bool ok() const { return ok_; }  ///< the prediction's covariance has a root
  /// Where nothing was measured: the prediction.
  Vector7d Start() const { return Unknowns(input_.prior, input_.shape); }
  int NumResiduals() const { return n_residuals_; }
  /// Half the sum of their squares is the robust cost.
  template <class T>
  bool operator()(const T* y, T* residuals) const;
  /// What a solution of this cost means.
  FitResult Read(const Vector7d& y, double cost) const;

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
  template <class T>
  T EdgeResidual(size_t side, const Edge& edge, const Unknown<T>& y) const;
  /// Shows each sample's residual, in standard deviations, and for how many it counts.
  template <class T, class Show>
  void ForEachSample(const Unknown<T>& y, const Show& show) const;
  /// Gauss's: the sum of the residuals' gradients' squares.
  Matrix7d Information(const Vector7d& y) const;
  void ReadSides(const std::array<std::vector<double>, 4>& edges, FitResult* out) const;
  bool ReadEvidence(const std::array<std::vector<double>, 4>& edges,
                    const std::vector<double>& points, FitResult* out) const;

  const FitInput& input_;
  const FitConfig& config_;
  const Solid solid_;
  bool ok_ = false;
  int n_residuals_ = 0;
  double prior_range_ = 1.0;                            // m, from the camera in the plan view
  Matrix7d root_ = Matrix7d::Zero();                    // of the prediction's information
  std::array<std::vector<Edge>, 4> edges_;              // by Side, those left out too
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();  // measured, frame W, m
  std::optional<Eigen::Matrix3d> position_root_;        // of its information
};

}  // namespace chase::perception
