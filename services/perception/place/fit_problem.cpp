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

double Value(double r) { return r; }
double Value(const Jet& r) { return r.a; }

}  // namespace

Vector7d Unknowns(const TargetGaussian& target, const TargetShape& shape) {
  Vector7d y;
  y << target.mean, shape.yaw;
  return y;
}

FitProblem::FitProblem(const FitInput& input, const FitConfig& config)
    : input_(input),
      config_(config),
      solid_{input.shape.box(), input.shape.size[0], input.shape.size[1]} {
  const Eigen::LLT<Matrix6d> llt(input.prior.covariance);
  if (llt.info() != Eigen::Success) return;
  root_.topLeftCorner<6, 6>() = llt.matrixL().solve(Matrix6d::Identity());
  root_(kYawAt, kYawAt) = 1.0 / std::sqrt(std::max(kYawFloor, input.shape.yaw_variance));
  if (!root_.allFinite()) return;
  ok_ = true;
  prior_range_ = Range(Start());
  AddEdges();
  AddPosition();
  n_residuals_ = kUnknowns;
  ForEachSample(Start(), [&](double, double) { n_residuals_ += 2; });
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
  position_root_ = llt.matrixL().solve(Eigen::Matrix3d::Identity());
  position_ = input_.camera.p_WC + R * *input_.detection->p_CT;
}

template <class T>
T FitProblem::EdgeResidual(size_t side, const Edge& edge, const Unknown<T>& y) const {
  const double sign = Sign(side);
  if (input_.shape.sphere())
    return edge.px * TangentResidual(edge.ray, solid_, Upright(side), sign, y);
  return edge.px * (Upright(side) ? SideResidual(edge.ray, solid_, sign, y)
                                  : CapResidual(edge.ray, solid_, sign, y));
}

template <class T, class Show>
void FitProblem::ForEachSample(const Unknown<T>& y, const Show& show) const {
  for (size_t side = 0; side < 4; ++side)
    for (const Edge& edge : edges_[side])
      if (input_.use_side[side])
        show(EdgeResidual(side, edge, y) / (input_.detection->silhouette.sigma_px * prior_range_),
             Share(edges_[side].size(), kEdgeWeight));
  for (const TargetPoint& p : input_.points)
    show(SurfaceDistance(input_.shape, p, y) / config_.lidar_sigma,
         Share(input_.points.size(), kLidarWeight));
  if (!position_root_) return;
  const Eigen::Matrix<T, 3, 1> off =
      position_root_->cast<T>() * (y.template head<3>() - position_.cast<T>());
  for (int i = 0; i < 3; ++i) show(off[i], 1.0);
}

template <class T>
bool FitProblem::operator()(const T* y, T* residuals) const {
  const Unknown<T> at = Eigen::Map<const Unknown<T>>(y);
  Eigen::Map<Unknown<T>>{residuals} = root_.cast<T>() * (at - Start().cast<T>());
  T* next = residuals + kUnknowns;
  ForEachSample(at, [&](const T& r, double share) {
    const double s = std::pow(Value(r) / kOutlier, 2), square = share * kOutlier * kOutlier;
    *next++ = std::sqrt(share / (1.0 + s)) * r;
    *next++ = T(std::sqrt(square * std::max(0.0, std::log1p(s) - s / (1.0 + s))));
  });
  return true;
}

template bool FitProblem::operator()(const double* y, double* residuals) const;
template bool FitProblem::operator()(const Jet* y, Jet* residuals) const;

Matrix7d FitProblem::Information(const Vector7d& y) const {
  std::vector<Jet> residuals(static_cast<size_t>(n_residuals_));
  (*this)(Jets(y).data(), residuals.data());
  Matrix7d sum = Matrix7d::Zero();
  for (const Jet& r : residuals) sum += r.v * r.v.transpose();
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
  const double yaw_variance = out->shape.yaw_variance * std::pow(root_(kYawAt, kYawAt), 2);
  const double log_prior =
      -root_.diagonal().head<6>().array().log().sum() - 0.5 * std::log(yaw_variance);
  double cost = 0.5 * out->prior_distance;
  for (size_t side = 0; side < 4; ++side)
    if (out->used[side])
      cost += BoundedCost(edges[side], input_.detection->silhouette.sigma_px, kEdgeWeight);
  cost += BoundedCost(points, config_.lidar_sigma, kLidarWeight);
  out->log_evidence = -cost + log_posterior - log_prior;
  return std::isfinite(out->log_evidence);
}

FitResult FitProblem::Read(const Vector7d& y, double cost) const {
  FitResult out;
  const Eigen::LLT<Matrix7d> llt(Information(y));
  if (llt.info() != Eigen::Success) return out;
  const Matrix7d covariance = llt.solve(Matrix7d::Identity());
  out.posterior.mean = y.head<6>();
  out.posterior.covariance = covariance.topLeftCorner<6, 6>();
  out.shape = input_.shape;
  out.shape.yaw = y[kYawAt];
  out.shape.yaw_variance = covariance(kYawAt, kYawAt);
  out.cost = cost;
  out.prior_distance = (root_ * (y - Start())).squaredNorm();
  std::array<std::vector<double>, 4> edges;
  for (size_t side = 0; side < 4; ++side)
    for (const auto& edge : edges_[side])
      edges[side].push_back(EdgeResidual(side, edge, y) / Range(y));
  ReadSides(edges, &out);
  std::vector<double> points;
  for (const auto& p : input_.points) {
    points.push_back(SurfaceDistance(input_.shape, p, y));
    out.point_rms += points.back() * points.back();
  }
  out.n_points = static_cast<int>(points.size());
  out.point_rms = std::sqrt(out.point_rms / std::max(1, out.n_points));
  out.ok = out.posterior.covariance.allFinite() && ReadEvidence(edges, points, &out);
  return out;
}

}  // namespace chase::perception
