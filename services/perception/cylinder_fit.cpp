#include "services/perception/cylinder_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "services/perception/cylinder_residuals.h"

namespace chase::perception {

namespace {

constexpr double kOutlier = 2.0;      // standard deviations where outliers begin
constexpr double kWorst = 3.0;        // standard deviations that an outlier counts for
constexpr double kShapeFloor = 1e-6;  // m^2

PlanRay ToPlan(const Camera& camera, const Eigen::Vector2d& px) {
  const Eigen::Vector3d ray = camera.Ray(px.x(), px.y());
  const double length = std::max(1e-9, ray.head<2>().norm());
  return {camera.p_WC, ray.head<2>() / length, ray.z() / length};
}

/// Angle in the plan view between the lines of sight one pixel apart in u [rad].
double PlanAnglePerPixel(const Camera& camera, const Eigen::Vector2d& px) {
  const PlanRay a = ToPlan(camera, px - Eigen::Vector2d(0.5, 0)),
                b = ToPlan(camera, px + Eigen::Vector2d(0.5, 0));
  return std::abs(a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x());
}

/// Change of slope between the lines of sight one pixel apart in v.
double SlopePerPixel(const Camera& camera, const Eigen::Vector2d& px) {
  return std::abs(ToPlan(camera, px + Eigen::Vector2d(0, 0.5)).slope -
                  ToPlan(camera, px - Eigen::Vector2d(0, 0.5)).slope);
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Half the sum of squares of samples that count for at most `weight` together.
double BoundedCost(const std::vector<double>& residuals, double sigma, double weight) {
  if (residuals.empty()) return 0.0;
  double sum = 0.0;
  for (double r : residuals) sum += 0.5 * std::min(kWorst * kWorst, r * r / (sigma * sigma));
  return sum * std::min(1.0, weight / static_cast<double>(residuals.size()));
}

/// One Ceres problem and the bookkeeping to read its residuals afterwards.
class Fit {
 public:
  Fit(const FitInput& input, const FitConfig& config)
      : input_(input),
        config_(config),
        x_(input.prior.mean),
        s_(input.shape.size),
        problem_(Options()) {}

  FitResult Run() {
    if (!AddPrior()) return {};
    AddEdges();
    AddPoints();
    AddPosition();
    ceres::Solver::Summary summary;
    ceres::Solve(SolverOptions(), &problem_, &summary);
    FitResult out;
    if (!summary.IsSolutionUsable() || !x_.allFinite() || !s_.allFinite()) return out;
    out.posterior.mean = x_;
    out.shape.size = s_;
    out.cost = summary.final_cost;
    out.ok = ReadCovariance(&out);
    ReadResiduals(&out);
    out.ok = out.ok && ReadEvidence(&out);
    return out;
  }

 private:
  static ceres::Problem::Options Options() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  ceres::Solver::Options SolverOptions() const {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.dense_linear_algebra_library_type = ceres::EIGEN;
    options.max_num_iterations = config_.max_iterations;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 1e-5;
    options.parameter_tolerance = 1e-6;
    return options;
  }

  template <class Residual>
  void AddScaled(const Residual& residual, ceres::LossFunction* loss) {
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Residual, 1, 6, 2>(new Residual(residual)), loss, x_.data(),
        s_.data());
  }

  bool AddPrior() {
    const Eigen::LLT<Matrix6d> llt(input_.prior.covariance);
    if (llt.info() != Eigen::Success) return false;
    root_ = llt.matrixL().solve(Matrix6d::Identity());
    if (!root_.allFinite()) return false;
    using Prior = PriorResidual<6>;
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Prior, 6, 6>(new Prior{input_.prior.mean, root_}), nullptr,
        x_.data());
    problem_.AddParameterBlock(s_.data(), 2);
    if (!config_.estimate_shape) {
      problem_.SetParameterBlockConstant(s_.data());
      return true;
    }
    using ShapePrior = PriorResidual<2>;
    const Eigen::Vector2d weight =
        input_.shape.variance.cwiseMax(kShapeFloor).cwiseSqrt().cwiseInverse();
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<ShapePrior, 2, 2>(new ShapePrior{
                                  input_.shape.size, Eigen::Matrix2d(weight.asDiagonal())}),
                              nullptr, s_.data());
    return true;
  }

  /// Robust loss of one of `samples` that count for `weight` independent ones together.
  ceres::LossFunction* Loss(size_t samples, double weight) {
    const double share = std::min(1.0, weight / static_cast<double>(samples));
    losses_.push_back(std::make_unique<ceres::ScaledLoss>(new ceres::CauchyLoss(kOutlier), share,
                                                          ceres::TAKE_OWNERSHIP));
    return losses_.back().get();
  }

  void AddEdges() {
    if (!input_.detection) return;
    const double sigma = input_.detection->silhouette.sigma_px;
    const double range =
        std::max(0.2, (input_.prior.position() - input_.camera.p_WC).head<2>().norm());
    for (int side = 0; side < 4; ++side) {
      const auto& samples = input_.detection->silhouette.samples[static_cast<size_t>(side)];
      if (!input_.use_side[static_cast<size_t>(side)] || samples.empty()) continue;
      ceres::LossFunction* loss = Loss(samples.size(), config_.edge_weight);
      const double sign = side == kRight || side == kTop ? 1.0 : -1.0;
      for (const auto& px : samples) {
        const PlanRay ray = ToPlan(input_.camera, px);
        if (side == kLeft || side == kRight)
          AddScaled(SideResidual{ray, sign, 1.0 / (sigma * range * Turn(px))}, loss);
        else
          AddScaled(CapResidual{ray, sign, 1.0 / (sigma * range * Climb(px))}, loss);
      }
    }
  }
  double Turn(const Eigen::Vector2d& px) const {
    return std::max(1e-6, PlanAnglePerPixel(input_.camera, px));
  }
  double Climb(const Eigen::Vector2d& px) const {
    return std::max(1e-6, SlopePerPixel(input_.camera, px));
  }

  void AddPoints() {
    if (input_.points.empty()) return;
    ceres::LossFunction* loss = Loss(input_.points.size(), config_.lidar_weight);
    for (const auto& p : input_.points)
      AddScaled(PointResidual{p.p_W, p.age, 1.0 / config_.lidar_sigma}, loss);
  }

  void AddPosition() {
    if (!input_.detection || !input_.detection->p_CT) return;
    const Eigen::Matrix3d& R = input_.camera.R_WC;
    const Eigen::LLT<Eigen::Matrix3d> llt(R * input_.detection->p_CT_covariance * R.transpose());
    if (llt.info() != Eigen::Success) return;
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PositionResidual, 3, 6>(
            new PositionResidual{input_.camera.p_WC + R * *input_.detection->p_CT,
                                 llt.matrixL().solve(Eigen::Matrix3d::Identity())}),
        Loss(1, 1.0), x_.data());
  }

  bool ReadCovariance(FitResult* out) {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks = {{x_.data(), x_.data()}};
    if (config_.estimate_shape) blocks.emplace_back(s_.data(), s_.data());
    if (!covariance.Compute(blocks, &problem_)) return false;
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> C;
    covariance.GetCovarianceBlock(x_.data(), x_.data(), C.data());
    out->posterior.covariance = 0.5 * (C + C.transpose());
    out->shape.variance = input_.shape.variance;
    if (config_.estimate_shape) {
      Eigen::Matrix<double, 2, 2, Eigen::RowMajor> S;
      covariance.GetCovarianceBlock(s_.data(), s_.data(), S.data());
      out->shape.variance = S.diagonal();
    }
    return out->posterior.covariance.allFinite();
  }

  /// Residuals of one side in px at the solution, without loss or weights.
  std::vector<double> EdgeResiduals(size_t side, double range) const {
    std::vector<double> all;
    for (const auto& px : input_.detection->silhouette.samples[side]) {
      const PlanRay ray = ToPlan(input_.camera, px);
      const double sign = side == kRight || side == kTop ? 1.0 : -1.0;
      double r = 0.0;
      if (side == kLeft || side == kRight)
        SideResidual{ray, sign, 1.0 / (range * Turn(px))}(x_.data(), s_.data(), &r);
      else
        CapResidual{ray, sign, 1.0 / (range * Climb(px))}(x_.data(), s_.data(), &r);
      all.push_back(r);
    }
    return all;
  }

  std::vector<double> PointResiduals() const {
    std::vector<double> all;
    for (const auto& p : input_.points) {
      double r = 0.0;
      PointResidual{p.p_W, p.age, 1.0}(x_.data(), s_.data(), &r);
      all.push_back(r);
    }
    return all;
  }

  /// -cost + log sqrt(det posterior / det prior). What single outliers cost is bounded.
  bool ReadEvidence(FitResult* out) const {
    const Eigen::LLT<Matrix6d> posterior(out->posterior.covariance);
    if (posterior.info() != Eigen::Success) return false;
    const double log_posterior = posterior.matrixLLT().diagonal().array().log().sum();
    const double log_prior = -root_.diagonal().array().log().sum();
    double cost = 0.5 * out->prior_distance;
    for (size_t side = 0; input_.detection && side < 4; ++side)
      if (out->used[side])
        cost += BoundedCost(EdgeResiduals(side, Range()), input_.detection->silhouette.sigma_px,
                            config_.edge_weight);
    cost += BoundedCost(PointResiduals(), config_.lidar_sigma, config_.lidar_weight);
    out->log_evidence = -cost + log_posterior - log_prior;
    return std::isfinite(out->log_evidence);
  }

  double Range() const {
    return std::max(0.2, (x_.head<3>() - input_.camera.p_WC).head<2>().norm());
  }

  void ReadResiduals(FitResult* out) const {
    const Vector6d d = root_ * (x_ - input_.prior.mean);
    out->prior_distance = d.squaredNorm();
    for (size_t side = 0; input_.detection && side < 4; ++side) {
      if (!input_.use_side[side] && !input_.detection->silhouette.samples[side].empty())
        out->whole = false;
      out->edge_px[side] = Median(EdgeResiduals(side, Range()));
      out->used[side] =
          input_.use_side[side] && !input_.detection->silhouette.samples[side].empty();
      const bool beyond = !out->used[side] && !input_.detection->silhouette.samples[side].empty() &&
                          out->edge_px[side] > 0.0;
      out->joined = out->joined || input_.detection->goes_on[side] || beyond;
    }
    out->n_points = static_cast<int>(input_.points.size());
    const auto distances = PointResiduals();
    double sum = 0.0;
    for (double r : distances) sum += r * r;
    if (!distances.empty()) out->point_rms = std::sqrt(sum / static_cast<double>(distances.size()));
  }

  const FitInput& input_;
  const FitConfig& config_;
  Vector6d x_;
  Eigen::Vector2d s_;
  Matrix6d root_ = Matrix6d::Zero();
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;  // outlive the problem
  ceres::Problem problem_;
};

}  // namespace

FitResult FitCylinder(const FitInput& input, const FitConfig& config) {
  return Fit(input, config).Run();
}

}  // namespace chase::perception
