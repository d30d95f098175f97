#include "services/perception/place/fit_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kOutlier = 2.0;      // standard deviations where outliers begin
constexpr double kWorst = 3.0;        // standard deviations that an outlier counts for
constexpr double kShapeFloor = 1e-6;  // m^2
constexpr double kYawFloor = 1e-6;    // rad^2
constexpr double kNearest = 0.2;      // m, of ranges that scale pixels
constexpr double kLeastPerPx = 1e-6;

PlanRay ToPlan(const Eigen::Vector3d& p_WC, const Eigen::Vector3d& ray) {
  const double length = std::max(1e-9, ray.head<2>().norm());
  return {p_WC, ray.head<2>() / length, ray.z() / length};
}

bool Upright(size_t side) { return side == kLeft || side == kRight; }
double Sign(size_t side) { return side == kRight || side == kTop ? 1.0 : -1.0; }

/// What lies between the lines of sight half a pixel to either side: the angle in the plan view
/// [rad] for the left and right edges, the change of slope for the others.
double PerPixel(const Camera& camera, const Eigen::Vector3d& ray, bool upright) {
  const Eigen::Vector3d half = camera.R_WC.col(upright ? 0 : 1) * (0.5 / camera.rig.focal_px);
  const PlanRay a = ToPlan(camera.p_WC, ray - half), b = ToPlan(camera.p_WC, ray + half);
  const double span = upright
                          ? a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x()
                          : b.slope - a.slope;
  return std::max(kLeastPerPx, std::abs(span));
}

/// Of one of `samples` that count for `weight` independent ones together.
double Share(size_t samples, double weight) {
  return std::min(1.0, weight / static_cast<double>(samples));
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
  return sum * Share(residuals.size(), weight);
}

/// Cauchy's loss rho(s) = b^2 log(1 + s / b^2) of samples with the squares s, which count for
/// `share` each. One logarithm is taken of a product.
class Cauchy {
 public:
  explicit Cauchy(double share) : share_(share) {}
  /// Adds a sample; slope of its loss.
  double Weight(double s) {
    const double u = 1.0 + s / (kOutlier * kOutlier);
    product_ *= u;
    if (product_ > kLargest) TakeLogarithm();
    return share_ / u;
  }
  /// Half the sum of the losses.
  double Cost() {
    TakeLogarithm();
    return 0.5 * share_ * kOutlier * kOutlier * log_;
  }

 private:
  static constexpr double kLargest = 1e100;
  void TakeLogarithm() {
    log_ += std::log(product_);
    product_ = 1.0;
  }
  double share_, product_ = 1.0, log_ = 0.0;
};

/// Sums up the cost alone.
struct CostSum {
  static constexpr bool kDerivatives = false;
  double cost = 0.0;
  void AddEdge(double, double, const Vector9d&) {}
  void Add(double, double, const Vector9d&) {}
};

/// Sums up cost and normal equations.
template <int N>
struct NormalSum : NormalEquations<N> {
  static constexpr bool kDerivatives = true;
  static constexpr int kUnknowns = N;
  /// An edge does not depend on the velocity, nor a round one on the heading.
  void AddEdge(double weight, double residual, const Vector9d& row) {
    if (N > 6) return Add(weight, residual, row);
    const Eigen::Vector3d weighed = weight * row.head<3>();
    this->gradient.template head<3>() += residual * weighed;
    this->information.template topLeftCorner<3, 3>() += weighed * row.head<3>().transpose();
  }
  void Add(double weight, double residual, const Vector9d& row) {
    const Eigen::Matrix<double, N, 1> weighed = weight * row.head<N>();
    this->gradient += residual * weighed;
    this->information.noalias() += weighed * row.head<N>().transpose();
  }
};

}  // namespace

Vector9d Unknowns(const TargetGaussian& target, const TargetShape& shape) {
  Vector9d y;
  y << target.mean, shape.yaw, shape.size;
  return y;
}

double SurfaceDistance(const TargetShape& shape, const TargetPoint& point, double scale,
                       const Vector9d& y, Vector9d* gradient) {
  if (shape.sphere()) return SpherePointResidual{point.p_W, point.age, scale}(y, gradient);
  return PointResidual{point.p_W, shape.box(), point.age, scale}(y, gradient);
}

FitProblem::FitProblem(const FitInput& input, const FitConfig& config)
    : input_(input), config_(config) {
  const Eigen::LLT<Matrix6d> llt(input.prior.covariance);
  if (llt.info() != Eigen::Success) return;
  root_ = llt.matrixL().solve(Matrix6d::Identity());
  if (!root_.allFinite()) return;
  ok_ = true;
  information_ = root_.transpose() * root_;
  shape_information_ << 1.0 / std::max(kYawFloor, input.shape.yaw_variance),
      input.shape.variance.cwiseMax(kShapeFloor).cwiseInverse();
  prior_range_ = Range(Start());
  AddEdges();
  AddPosition();
}

double FitProblem::Range(const Vector9d& y) const {
  return std::max(kNearest, (y.head<2>() - input_.camera.p_WC.head<2>()).norm());
}

void FitProblem::AddEdges() {
  for (size_t side = 0; input_.detection && side < 4; ++side) {
    const auto& samples = input_.detection->silhouette.samples[side];
    edges_[side].reserve(samples.size());
    for (const auto& px : samples) {
      const Camera camera = input_.camera.AtRow(px.y());
      const Eigen::Vector3d ray = camera.Ray(px.x(), px.y());
      edges_[side].push_back(
          {ToPlan(camera.p_WC, ray), 1.0 / PerPixel(camera, ray, Upright(side))});
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

double FitProblem::EdgeResidual(size_t side, const Edge& edge, double scale, const Vector9d& y,
                                Vector9d* gradient) const {
  if (input_.shape.sphere())
    return TangentResidual{edge.ray, Upright(side), Sign(side), scale * edge.px}(y, gradient);
  const bool square = input_.shape.box();
  if (Upright(side))
    return SideResidual{edge.ray, square, Sign(side), scale * edge.px}(y, gradient);
  return CapResidual{edge.ray, square, Sign(side), scale * edge.px}(y, gradient);
}

template <class Sum>
void FitProblem::EvaluatePrior(const Vector9d& y, Sum* sum) const {
  const Vector6d d = y.head<6>() - input_.prior.mean;
  const Vector6d gradient = information_ * d;
  sum->cost += 0.5 * d.dot(gradient);
  const Eigen::Vector3d off = y.tail<3>() - Start().tail<3>();
  const Eigen::Vector3d by_shape = shape_information_.cwiseProduct(off);
  sum->cost += 0.5 * off.dot(by_shape);  // what is not sought stays where it starts
  if constexpr (Sum::kDerivatives) {
    sum->gradient.template head<6>() += gradient;
    sum->information.template topLeftCorner<6, 6>() += information_;
    constexpr int kMore = Sum::kUnknowns - 6;
    sum->gradient.template tail<kMore>() += by_shape.head<kMore>();
    sum->information.diagonal().template tail<kMore>() += shape_information_.head<kMore>();
  }
}

template <class Sum>
void FitProblem::EvaluateEdges(const Vector9d& y, Sum* sum) const {
  Vector9d row;
  for (size_t side = 0; side < 4; ++side) {
    if (!input_.use_side[side] || edges_[side].empty()) continue;
    Cauchy loss(Share(edges_[side].size(), config_.edge_weight));
    const double scale = 1.0 / (input_.detection->silhouette.sigma_px * prior_range_);
    for (const auto& edge : edges_[side]) {
      const double r = EdgeResidual(side, edge, scale, y, Sum::kDerivatives ? &row : nullptr);
      sum->AddEdge(loss.Weight(r * r), r, row);
    }
    sum->cost += loss.Cost();
  }
}

template <class Sum>
void FitProblem::EvaluatePoints(const Vector9d& y, Sum* sum) const {
  if (input_.points.empty()) return;
  Vector9d row;
  Cauchy loss(Share(input_.points.size(), config_.lidar_weight));
  const double scale = 1.0 / config_.lidar_sigma;
  for (const auto& p : input_.points) {
    const double r = SurfaceDistance(input_.shape, p, scale, y, Sum::kDerivatives ? &row : nullptr);
    sum->Add(loss.Weight(r * r), r, row);
  }
  sum->cost += loss.Cost();
}

template <class Sum>
void FitProblem::EvaluatePosition(const Vector9d& y, Sum* sum) const {
  if (!position_information_) return;
  const Eigen::Vector3d off = y.head<3>() - position_;
  const Eigen::Vector3d gradient = *position_information_ * off;
  Cauchy loss(1.0);
  const double weight = loss.Weight(off.dot(gradient));
  sum->cost += loss.Cost();
  if constexpr (Sum::kDerivatives) {
    sum->gradient.template head<3>() += weight * gradient;
    sum->information.template topLeftCorner<3, 3>() += weight * *position_information_;
  }
}

template <class Sum>
void FitProblem::Evaluate(const Vector9d& y, Sum* sum) const {
  EvaluatePrior(y, sum);
  EvaluateEdges(y, sum);
  EvaluatePoints(y, sum);
  EvaluatePosition(y, sum);
}

double FitProblem::Cost(const Vector9d& y) const {
  CostSum sum;
  Evaluate(y, &sum);
  return sum.cost;
}

template <int N>
NormalEquations<N> FitProblem::Linearised(const Vector9d& y) const {
  NormalSum<N> sum;
  Evaluate(y, &sum);
  return sum;
}

template NormalEquations<6> FitProblem::Linearised<6>(const Vector9d&) const;
template NormalEquations<7> FitProblem::Linearised<7>(const Vector9d&) const;
template NormalEquations<9> FitProblem::Linearised<9>(const Vector9d&) const;

/// Residuals of one side in px, without loss or weights.
std::vector<double> FitProblem::EdgeResiduals(size_t side, const Vector9d& y) const {
  std::vector<double> all;
  all.reserve(edges_[side].size());
  for (const auto& edge : edges_[side])
    all.push_back(EdgeResidual(side, edge, 1.0 / Range(y), y, nullptr));
  return all;
}

std::vector<double> FitProblem::PointResiduals(const Vector9d& y) const {
  std::vector<double> all;
  all.reserve(input_.points.size());
  for (const auto& p : input_.points)
    all.push_back(SurfaceDistance(input_.shape, p, 1.0, y, nullptr));
  return all;
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
  double log_prior = -root_.diagonal().array().log().sum();
  if (input_.shape.box())  // the heading counts by itself
    log_prior -= 0.5 * std::log(shape_information_[0] * out->shape.yaw_variance);
  double cost = 0.5 * out->prior_distance;
  for (size_t side = 0; side < 4; ++side)
    if (out->used[side])
      cost += BoundedCost(edges[side], input_.detection->silhouette.sigma_px, config_.edge_weight);
  cost += BoundedCost(points, config_.lidar_sigma, config_.lidar_weight);
  out->log_evidence = -cost + log_posterior - log_prior;
  return std::isfinite(out->log_evidence);
}

FitResult FitProblem::Read(const Vector9d& y, const Matrix9d& covariance, double cost) const {
  FitResult out;
  out.posterior.mean = y.head<6>();
  out.posterior.covariance = covariance.topLeftCorner<6, 6>();
  out.shape = input_.shape;
  out.shape.size = y.tail<2>();
  if (config_.estimate_shape) out.shape.variance = covariance.diagonal().tail<2>();
  out.cost = cost;
  out.prior_distance = (root_ * (out.posterior.mean - input_.prior.mean)).squaredNorm();
  if (input_.shape.box()) {
    out.shape.yaw = y[kYawAt];
    out.shape.yaw_variance = covariance(kYawAt, kYawAt);
    const double turn = y[kYawAt] - input_.shape.yaw;
    out.prior_distance += shape_information_[0] * turn * turn;
  }
  std::array<std::vector<double>, 4> edges;
  for (size_t side = 0; side < 4; ++side) edges[side] = EdgeResiduals(side, y);
  ReadSides(edges, &out);
  const auto points = PointResiduals(y);
  out.n_points = static_cast<int>(points.size());
  for (double r : points) out.point_rms += r * r / static_cast<double>(points.size());
  out.point_rms = std::sqrt(out.point_rms);
  out.ok = out.posterior.covariance.allFinite() && ReadEvidence(edges, points, &out);
  return out;
}

}  // namespace chase::perception
