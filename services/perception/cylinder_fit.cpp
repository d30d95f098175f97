#include "services/perception/cylinder_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "services/perception/cylinder_residuals.h"

namespace chase::perception {

namespace {

constexpr double kEdgeLoss = 2.0, kPointLoss = 2.0;  // standard deviations where outliers begin
constexpr double kShapeFloor = 1e-6;                 // m^2

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

/// One Ceres problem and the bookkeeping to read its residuals afterwards.
class Fit {
 public:
  Fit(const FitInput& input, const FitConfig& config)
      : input_(input),
        config_(config),
        x_(input.prior.mean),
        s_(input.shape.size),
        problem_(Options()),
        edge_loss_(kEdgeLoss),
        point_loss_(kPointLoss) {}

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

  template <class Residual, class Loss>
  void AddScaled(const Residual& residual, Loss* loss) {
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

  /// 1/m: turns metres beside the line of sight into standard deviations of one sample.
  double EdgeScale(double meters_per_px, size_t samples) const {
    const double sigma =
        input_.detection->silhouette.sigma_px *
        std::sqrt(std::max(1.0, static_cast<double>(samples) / config_.edge_weight));
    return 1.0 / (sigma * std::max(1e-6, meters_per_px));
  }

  void AddEdges() {
    if (!input_.detection) return;
    const double range =
        std::max(0.2, (input_.prior.position() - input_.camera.p_WC).head<2>().norm());
    for (int side = 0; side < 4; ++side) {
      if (!input_.use_side[static_cast<size_t>(side)]) continue;
      const auto& samples = input_.detection->silhouette.samples[static_cast<size_t>(side)];
      for (const auto& px : samples) {
        const PlanRay ray = ToPlan(input_.camera, px);
        if (side == kLeft || side == kRight)
          AddScaled(
              SideResidual{ray, side == kRight ? 1.0 : -1.0,
                           EdgeScale(range * PlanAnglePerPixel(input_.camera, px), samples.size())},
              &edge_loss_);
        else
          AddScaled(
              CapResidual{ray, side == kTop ? 1.0 : -1.0,
                          EdgeScale(range * SlopePerPixel(input_.camera, px), samples.size())},
              &edge_loss_);
      }
    }
  }

  void AddPoints() {
    const double n = static_cast<double>(input_.points.size());
    const double sigma = config_.lidar_sigma * std::sqrt(std::max(1.0, n / config_.lidar_weight));
    for (const auto& p : input_.points)
      AddScaled(PointResidual{p.p_W, p.age, 1.0 / sigma}, &point_loss_);
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
        &edge_loss_, x_.data());
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

  /// Mean residual of one side in px at the solution, without loss or weights.
  double EdgeResidual(size_t side, double range) const {
    double sum = 0.0;
    const auto& samples = input_.detection->silhouette.samples[side];
    for (const auto& px : samples) {
      const PlanRay ray = ToPlan(input_.camera, px);
      double r = 0.0;
      if (side == kLeft || side == kRight)
        SideResidual{ray, side == kRight ? 1.0 : -1.0,
                     1.0 / (range * PlanAnglePerPixel(input_.camera, px))}(x_.data(), s_.data(),
                                                                           &r);
      else
        CapResidual{ray, side == kTop ? 1.0 : -1.0,
                    1.0 / (range * SlopePerPixel(input_.camera, px))}(x_.data(), s_.data(), &r);
      sum += r;
    }
    return samples.empty() ? 0.0 : sum / static_cast<double>(samples.size());
  }

  void ReadResiduals(FitResult* out) const {
    const Vector6d d = root_ * (x_ - input_.prior.mean);
    out->prior_distance = d.squaredNorm();
    const double range = std::max(0.2, (x_.head<3>() - input_.camera.p_WC).head<2>().norm());
    for (size_t side = 0; input_.detection && side < 4; ++side) {
      out->edge_px[side] = EdgeResidual(side, range);
      out->used[side] =
          input_.use_side[side] && !input_.detection->silhouette.samples[side].empty();
    }
    out->n_points = static_cast<int>(input_.points.size());
    double sum = 0.0;
    for (const auto& p : input_.points) {
      double r = 0.0;
      PointResidual{p.p_W, p.age, 1.0}(x_.data(), s_.data(), &r);
      sum += r * r;
    }
    if (!input_.points.empty())
      out->point_rms = std::sqrt(sum / static_cast<double>(input_.points.size()));
  }

  const FitInput& input_;
  const FitConfig& config_;
  Vector6d x_;
  Eigen::Vector2d s_;
  Matrix6d root_ = Matrix6d::Zero();
  ceres::Problem problem_;
  ceres::HuberLoss edge_loss_;
  ceres::CauchyLoss point_loss_;
};

}  // namespace

FitResult FitCylinder(const FitInput& input, const FitConfig& config) {
  return Fit(input, config).Run();
}

}  // namespace chase::perception
