#include "services/perception/place/fit_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kOutlier = 2.0;    // standard deviations where outliers begin
constexpr double kWorst = 3.0;      // standard deviations that an outlier counts for
constexpr double kYawFloor = 1e-6;  // rad^2
constexpr double kLeastPerPx = 1e-6;

PlanRay ToPlan(const Eigen::Vector3d& p_WC, const Eigen::Vector3d& ray) {
  const double length = std::max(1e-9, ray.head<2>().norm());
  return {p_WC, ray.head<2>() / length, ray.z() / length};
}

bool Upright(size_t side) { return side == kLeft || side == kRight; }
double Sign(size_t side) { return side == kRight || side == kTop ? 1.0 : -1.0; }

/// What lies between the lines of sight half a pixel to either side: the angle in the plan view
/// [rad] for the left and right edges, the change of slope for the others.
double PerPixel(const Camera& camera, const Eigen::Vector2d& px, bool upright) {
  const Eigen::Vector2d half = upright ? Eigen::Vector2d(0.5, 0.0) : Eigen::Vector2d(0.0, 0.5);
  const auto at = [&](const Eigen::Vector2d& p) {
    return ToPlan(camera.p_WC, camera.Ray(p.x(), p.y()));
  };
  const PlanRay a = at(px - half), b = at(px + half);
  const double span = upright
                          ? a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x()
                          : b.slope - a.slope;
  return std::max(kLeastPerPx, std::abs(span));
}

Solid SolidOf(const TargetShape& shape) { return {shape.box(), shape.size[0], shape.size[1]}; }

/// Of one of `samples` that count for `weight` independent ones together.
double Share(size_t samples, double weight) {
  return std::min(1.0, weight / static_cast<double>(std::max<size_t>(1, samples)));
}

/// Half the sum of squares of samples that count for at most `weight` together.
double BoundedCost(const std::vector<double>& residuals, double sigma, double weight) {
  if (residuals.empty()) return 0.0;
  double sum = 0.0;
  for (double r : residuals) sum += 0.5 * std::min(kWorst * kWorst, r * r / (sigma * sigma));
  return sum * Share(residuals.size(), weight);
}

/// Cauchy's loss rho(s) = b^2 log(1 + s / b^2) of samples with the squares s, which count for
/// `share` each.
class Cauchy {
 public:
  explicit Cauchy(double share) : share_(share) {}
  /// Adds a sample; slope of its loss.
  double Weight(double s) {
    const double u = 1.0 + s / (kOutlier * kOutlier);
    cost_ += 0.5 * share_ * kOutlier * kOutlier * std::log(u);
    return share_ / u;
  }
  /// Half the sum of the losses.
  double cost() const { return cost_; }

 private:
  double share_, cost_ = 0.0;
};

}  // namespace

Vector7d Unknowns(const TargetGaussian& target, const TargetShape& shape) {
  Vector7d y;
  y << target.mean, shape.yaw;
  return y;
}

Residual SurfaceDistance(const TargetShape& shape, const TargetPoint& point, const Vector7d& y) {
  return (shape.sphere() ? SpherePointResidual : PointResidual)(point.p_W, point.age,
                                                                SolidOf(shape), y);
}

FitProblem::FitProblem(const FitInput& input, const FitConfig& config)
    : input_(input), config_(config), solid_(SolidOf(input.shape)) {
  const Eigen::LLT<Matrix6d> llt(input.prior.covariance);
  if (llt.info() != Eigen::Success) return;
  root_ = llt.matrixL().solve(Matrix6d::Identity());
  if (!root_.allFinite()) return;
  ok_ = true;
  information_.topLeftCorner<6, 6>() = root_.transpose() * root_;
  information_(kYawAt, kYawAt) = 1.0 / std::max(kYawFloor, input.shape.yaw_variance);
  prior_range_ = Range(Start());
  AddEdges();
  AddPosition();
}

double FitProblem::Range(const Vector7d& y) const {
  return std::max(kNearest, (y.head<2>() - input_.camera.p_WC.head<2>()).norm());
}

void FitProblem::AddEdges() {
  for (size_t side = 0; input_.detection && side < 4; ++side) {
    const auto& samples = input_.detection->silhouette.samples[side];
    edges_[side].reserve(samples.size());
    for (const auto& px : samples) {
      const Camera camera = input_.camera.AtRow(px.y());
      const Eigen::Vector3d ray = camera.Ray(px.x(), px.y());
      edges_[side].push_back({ToPlan(camera.p_WC, ray), 1.0 / PerPixel(camera, px, Upright(side))});
    }
  }
}

void FitProblem::AddPosition() {
  if (!input_.detection || !input_.detection->p_CT) return;
  const Eigen::Matrix3d& R = input_.camera.R_WC;
  const Eigen::LLT<Eigen::Matrix3d> llt(R * input_.detection->p_CT_covariance * R.transpose());
  if (llt.info() != Eigen::Success) return;
  position_information_ = llt.solve(Eigen::Matrix3d::Identity());
  position_ = input_.camera.p_WC + R * *input_.detection->p_CT;
}

Residual FitProblem::EdgeResidual(size_t side, const Edge& edge, const Vector7d& y) const {
  const double sign = Sign(side);
  if (input_.shape.sphere())
    return TangentResidual(edge.ray, solid_, Upright(side), sign, y).Scaled(edge.px);
  return (Upright(side) ? SideResidual : CapResidual)(edge.ray, solid_, sign, y).Scaled(edge.px);
}

NormalEquations FitProblem::Linearised(const Vector7d& y) const {
  NormalEquations sum;
  const Vector7d off = y - Start();
  sum.information = information_;
  sum.gradient = information_ * off;
  sum.cost = 0.5 * off.dot(sum.gradient);
  for (size_t side = 0; side < 4; ++side) {
    if (!input_.use_side[side] || edges_[side].empty()) continue;
    Cauchy loss(Share(edges_[side].size(), kEdgeWeight));
    const double scale = 1.0 / (input_.detection->silhouette.sigma_px * prior_range_);
    for (const auto& edge : edges_[side]) {
      const Residual r = EdgeResidual(side, edge, y).Scaled(scale);
      sum.Add(loss.Weight(r.value * r.value), r);
    }
    sum.cost += loss.cost();
  }
  Cauchy loss(Share(input_.points.size(), kLidarWeight));
  for (const auto& p : input_.points) {
    const Residual r = SurfaceDistance(input_.shape, p, y).Scaled(1.0 / config_.lidar_sigma);
    sum.Add(loss.Weight(r.value * r.value), r);
  }
  sum.cost += loss.cost();
  if (!position_information_) return sum;
  const Eigen::Vector3d beside = y.head<3>() - position_;
  const Eigen::Vector3d gradient = *position_information_ * beside;
  Cauchy stray(1.0);
  const double weight = stray.Weight(beside.dot(gradient));
  sum.cost += stray.cost();
  sum.gradient.head<3>() += weight * gradient;
  sum.information.topLeftCorner<3, 3>() += weight * *position_information_;
  return sum;
}

void FitProblem::ReadSides(const std::array<std::vector<double>, 4>& edges, FitResult* out) const {
  for (size_t side = 0; input_.detection && side < 4; ++side) {
    const bool seen = !edges[side].empty(), used = input_.use_side[side] && seen;
    out->edge_px[side] = Median(edges[side]);
    out->used[side] = used;
    out->whole = out->whole && (used || !seen);
    const bool beyond = seen && !used && out->edge_px[side] > 0.0;
    out->joined = out->joined || input_.detection->goes_on[side] || beyond;
  }
}

/// -cost + log sqrt(det posterior / det prior). What single outliers cost is bounded; a measured
/// position, which may be a stray one, costs nothing here.
bool FitProblem::ReadEvidence(const std::array<std::vector<double>, 4>& edges,
                              const std::vector<double>& points, FitResult* out) const {
  const Eigen::LLT<Matrix6d> posterior(out->posterior.covariance);
  if (posterior.info() != Eigen::Success) return false;
  const double log_posterior = posterior.matrixLLT().diagonal().array().log().sum();
  const double log_prior = -root_.diagonal().array().log().sum() -
                           0.5 * std::log(information_(kYawAt, kYawAt) * out->shape.yaw_variance);
  double cost = 0.5 * out->prior_distance;
  for (size_t side = 0; side < 4; ++side)
    if (out->used[side])
      cost += BoundedCost(edges[side], input_.detection->silhouette.sigma_px, kEdgeWeight);
  cost += BoundedCost(points, config_.lidar_sigma, kLidarWeight);
  out->log_evidence = -cost + log_posterior - log_prior;
  return std::isfinite(out->log_evidence);
}

FitResult FitProblem::Read(const Vector7d& y, const Matrix7d& covariance, double cost) const {
  FitResult out;
  out.posterior.mean = y.head<6>();
  out.posterior.covariance = covariance.topLeftCorner<6, 6>();
  out.shape = input_.shape;
  out.shape.yaw = y[kYawAt];
  out.shape.yaw_variance = covariance(kYawAt, kYawAt);
  out.cost = cost;
  const double turn = y[kYawAt] - input_.shape.yaw;
  out.prior_distance = (root_ * (out.posterior.mean - input_.prior.mean)).squaredNorm() +
                       information_(kYawAt, kYawAt) * turn * turn;
  std::array<std::vector<double>, 4> edges;
  for (size_t side = 0; side < 4; ++side)
    for (const auto& edge : edges_[side])
      edges[side].push_back(EdgeResidual(side, edge, y).value / Range(y));
  ReadSides(edges, &out);
  std::vector<double> points;
  for (const auto& p : input_.points) {
    points.push_back(SurfaceDistance(input_.shape, p, y).value);
    out.point_rms += points.back() * points.back();
  }
  out.n_points = static_cast<int>(points.size());
  out.point_rms = std::sqrt(out.point_rms / std::max(1, out.n_points));
  out.ok = out.posterior.covariance.allFinite() && ReadEvidence(edges, points, &out);
  return out;
}

}  // namespace chase::perception
