#include "services/prediction/candidate_set.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "services/prediction/steady_motion.h"

namespace chase::prediction {
namespace {

constexpr double kExpLimit = 600.0;

// integral over [from, 1] of the products of d^order/dtau^order tau^i and tau^j.
Eigen::MatrixXd Gram(int rows, int order, double from) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(rows, rows);
  const auto falling = [order](int i) {
    double value = 1.0;
    for (int k = 0; k < order; ++k) value *= i - k;
    return value;
  };
  for (int i = order; i < rows; ++i)
    for (int j = order; j < rows; ++j) {
      const int power = i + j - 2 * order + 1;
      gram(i, j) = falling(i) * falling(j) * (1.0 - std::pow(from, power)) / power;
    }
  return gram;
}

Eigen::MatrixXd Powers(const std::vector<Observation>& observations, double now, double horizon,
                       int rows) {
  Eigen::MatrixXd powers(rows, static_cast<Eigen::Index>(observations.size()));
  for (Eigen::Index n = 0; n < powers.cols(); ++n) {
    const double tau = (observations[static_cast<size_t>(n)].t - now) / horizon;
    powers(0, n) = 1.0;
    for (int k = 1; k < rows; ++k) powers(k, n) = powers(k - 1, n) * tau;
  }
  return powers;
}

// Points in space: the mean, then points spread over the contour (Fibonacci's spiral on the
// sphere).
std::vector<Eigen::Vector3d> SpatialPoints(const Eigen::Matrix3d& covariance, double sigmas,
                                           int count) {
  const Eigen::Matrix3d L = covariance.llt().matrixL();
  std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero()};
  for (int i = 1; i < count; ++i) {
    const double z = 1.0 - (2.0 * i - 1.0) / (count - 1);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z)), angle = 2.399963229728653 * i;
    points.push_back(sigmas *
                     (L * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z)).eval());
  }
  return points;
}

}  // namespace

double GuardedExp(double x) {
  return x < kExpLimit ? std::exp(x) : std::exp(kExpLimit) * (1.0 + (x - kExpLimit));
}

double GuardedExpSlope(double x) { return std::exp(std::min(x, kExpLimit)); }

CandidateSet::CandidateSet(const PredictorConfig& config, const std::vector<Observation>& all,
                           double now)
    : samples_(config.samples),
      rows_(config.degree + 1),
      axes_(config.planar ? 2 : 3),
      horizon_(config.horizon),
      relative_(config.motion.steady) {
  const size_t steps = std::min(all.size(), static_cast<size_t>(config.steps));
  const std::vector<Observation> observations(all.end() - static_cast<ptrdiff_t>(steps), all.end());
  powers_ = Powers(observations, now, config.horizon, rows_);
  from_ = std::min(0.0, powers_.row(1).maxCoeff());
  for (const Observation& o : observations) {
    covariances_.push_back(
        math::MadePositiveDefinite(o.covariance, config.sigma_floor * config.sigma_floor));
    const double spread = std::max(config.sigma_floor, config.spread);
    spreads_.push_back(math::MadePositiveDefinite(o.covariance, spread * spread));
  }
  Fit(config, observations);
  if (relative_) FitSteady(config, all, now);
  Slow(config.max_target_speed);
  AddPoints(config);
  MakeSmoothness();
  MakeExponent(config, observations);
}

int64_t CandidateSet::count() const {
  const double product = std::pow(samples_, steps());
  if (product > 4e18) return int64_t{1} << 62;
  int64_t count = 1;
  for (int n = 0; n < steps(); ++n) count *= samples_;
  return count;
}

// Jeon 2021, eq. (9) and (10) in normalised time, per metre of each point.
void CandidateSet::Fit(const PredictorConfig& config,
                       const std::vector<Observation>& observations) {
  const double T = horizon_, w = config.fit_weight;
  Eigen::MatrixXd M = Gram(rows_, 2, from_) / (T * T * T) + w * powers_ * powers_.transpose();
  M += config.damping / T * Gram(rows_, 1, from_);
  // Keeps M regular when all observations share one time: then the target is taken to rest.
  const double ridge = 1e-12 * M.trace();
  for (int k = 1; k < rows_; ++k) M(k, k) += ridge;
  map_ = M.ldlt().solve(w * powers_);

  // The fit does not depend on the origin only if the map reproduces constants; an origin near the
  // data and the exact sums 1, 0, 0, ... make that so in spite of rounding.
  Eigen::MatrixXd means(observations.size(), 3);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  for (size_t n = 0; n < observations.size(); ++n) {
    means.row(static_cast<Eigen::Index>(n)) = observations[n].mean;
    const Eigen::Matrix3d inverse = covariances_[n].inverse();
    information += inverse;
    weighted += inverse * observations[n].mean;
  }
  const Eigen::Vector3d origin = information.ldlt().solve(weighted);
  means.rowwise() -= origin.transpose();
  mean_fit_ = map_ * means;
  if (axes_ == 2) mean_fit_.col(2).setZero();
  mean_fit_.row(0) += origin.transpose();
}

void CandidateSet::FitSteady(const PredictorConfig& config, const std::vector<Observation>& all,
                             double now) {
  const Eigen::RowVector3d at = mean_fit_.row(0);
  mean_fit_ = SteadyForecast(config.motion, all, now, horizon_, rows_, config.max_target_speed);
  if (axes_ == 3) return;
  mean_fit_.col(2).setZero();
  mean_fit_(0, 2) = at.z();
}

void CandidateSet::Slow(double max_speed) {
  double fastest = 0.0;
  for (double tau = 0.0; tau <= 1.0; tau += 0.0625) {
    Eigen::RowVector3d v = Eigen::RowVector3d::Zero();
    for (int k = rows_ - 1; k > 0; --k) v = v * tau + k * mean_fit_.row(k);
    fastest = std::max(fastest, v.norm() / horizon_);
  }
  if (!(fastest > max_speed)) return;
  mean_fit_.bottomRows(rows_ - 1) *= max_speed / fastest;
  map_.bottomRows(rows_ - 1) *= max_speed / fastest;
}

void CandidateSet::AddPoints(const PredictorConfig& config) {
  for (Eigen::Index n = 0; n < map_.cols(); ++n) {
    const Eigen::Matrix3d& covariance = spreads_[static_cast<size_t>(n)];
    const auto points = axes_ == 2 ? math::ContourPoints({Eigen::Vector3d::Zero(), covariance},
                                                         config.contour_sigmas, samples_)
                                   : SpatialPoints(covariance, config.contour_sigmas, samples_);
    Eigen::MatrixXd c(dims(), samples_);
    for (int i = 0; i < samples_; ++i)
      for (int a = 0; a < axes_; ++a)
        c.col(i).segment(a * rows_, rows_) = map_.col(n) * points[static_cast<size_t>(i)][a];
    contributions_.push_back(c);
  }
}

void CandidateSet::MakeSmoothness() {
  const Eigen::MatrixXd H = Gram(rows_, 2, from_) / (horizon_ * horizon_ * horizon_);
  smoothness_.gradient = Eigen::VectorXd::Zero(dims());
  smoothness_.hessian_half = Eigen::MatrixXd::Zero(dims(), dims());
  for (int a = 0; a < axes_; ++a) {
    Eigen::VectorXd q = mean_fit_.col(a);
    if (relative_) q.setZero();
    smoothness_.constant += q.dot(H * q);
    smoothness_.gradient.segment(a * rows_, rows_) = 2.0 * H * q;
    smoothness_.hessian_half.block(a * rows_, a * rows_, rows_, rows_) = H;
  }
}

// The density of the moving axes is the marginal one: its covariance is the block of them.
void CandidateSet::MakeExponent(const PredictorConfig& config,
                                const std::vector<Observation>& observations) {
  exponent_.constant = config.density_weight > 0.0 ? std::log(config.density_weight) : -1e6;
  exponent_.gradient = Eigen::VectorXd::Zero(dims());
  exponent_.hessian_half = Eigen::MatrixXd::Zero(dims(), dims());
  for (int n = 0; n < steps(); ++n) {
    const Eigen::MatrixXd Q =
        spreads_[static_cast<size_t>(n)].topLeftCorner(axes_, axes_).inverse();
    const Eigen::VectorXd phi = powers_.col(n);
    Eigen::VectorXd e = (mean_fit_.transpose() * phi).head(axes_) -
                        observations[static_cast<size_t>(n)].mean.head(axes_);
    if (relative_) e.setZero();
    const Eigen::VectorXd Qe = Q * e;
    exponent_.constant += 0.5 * e.dot(Qe);
    for (int a = 0; a < axes_; ++a) {
      exponent_.gradient.segment(a * rows_, rows_) += Qe[a] * phi;
      for (int b = 0; b < axes_; ++b)
        exponent_.hessian_half.block(a * rows_, b * rows_, rows_, rows_) +=
            0.5 * Q(a, b) * phi * phi.transpose();
    }
  }
}

Eigen::VectorXd CandidateSet::Delta(const Choice& choice) const {
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(dims());
  for (int n = 0; n < steps(); ++n) delta += contributions(n).col(choice[static_cast<size_t>(n)]);
  return delta;
}

Coefficients CandidateSet::CoefficientsOf(const Eigen::VectorXd& delta) const {
  Coefficients q = mean_fit_;
  for (int a = 0; a < axes_; ++a) q.col(a) += delta.segment(a * rows_, rows_);
  return q;
}

Eigen::Matrix3d CandidateSet::Covariance(int row) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int n = 0; n < steps(); ++n)
    sum += map_(row, n) * map_(row, n) * covariances_[static_cast<size_t>(n)];
  return sum;
}

}  // namespace chase::prediction
