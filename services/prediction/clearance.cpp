#include "services/prediction/clearance.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/math/bernstein.h"
#include "common/math/exact.h"

namespace chase::prediction {
namespace {

constexpr double kRounding = 0x1p-53;

// Row j: weights C(j,k) / C(n,k) of the power coefficients in the j-th Bernstein coefficient.
Eigen::MatrixXd BernsteinWeights(int degree) {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(degree + 1, degree + 1);
  for (int j = 0; j <= degree; ++j)
    for (int k = 0; k <= j; ++k) weights(j, k) = math::Binomial(j, k) / math::Binomial(degree, k);
  return weights;
}

const Eigen::MatrixXd& CachedWeights(int degree) {
  static const auto kTable = [] {
    std::array<Eigen::MatrixXd, 32> table;
    for (int n = 0; n < 32; ++n) table[static_cast<size_t>(n)] = BernsteinWeights(n);
    return table;
  }();
  return kTable[static_cast<size_t>(degree)];
}

// d(tau) - 1 in Bernstein form and a bound on the absolute error of each of its coefficients.
struct Distance {
  math::Polynomial bernstein;
  double error;
};

// A power coefficient of d takes at most size + 8 roundings on the way from the inputs (difference
// of the centres, row of R, convolution, sum over axes, the final 1), so it is off by less than
// (size + 9) u times the same sum over absolute values; that sum over all coefficients is the
// product of the sums below. Bernstein weights are at most 1 and add the term of
// PowerToBernsteinError.
Distance MakeDistance(const Coefficients& q, const HorizonObstacle& obstacle) {
  const Eigen::Index size = std::max(q.rows(), obstacle.center.rows());
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 16, 3> x(size, 3);
  x.setZero();
  x.topRows(q.rows()) = q;
  x.topRows(obstacle.center.rows()) -= obstacle.center;
  const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 16, 3> y = x * obstacle.shape;
  math::Polynomial d = math::Polynomial::Zero(2 * size - 1);
  for (int a = 0; a < 3; ++a)
    for (Eigen::Index i = 0; i < size; ++i) d.segment(i, size) += x(i, a) * y.col(a);
  d[0] -= 1.0;
  const Eigen::RowVector3d sums = x.cwiseAbs().colwise().sum();
  const double absolute = 1.0 + sums.dot(sums * obstacle.shape.cwiseAbs());
  const double n = static_cast<double>(size);
  const double error = 1.01 * (n + 9.0) * kRounding * absolute + math::PowerToBernsteinError(d);
  return {CachedWeights(static_cast<int>(d.size()) - 1) * d, error};
}

bool IsClearExact(const Coefficients& q, const HorizonObstacle& obstacle) {
  std::array<math::ExactPolynomial, 3> x;
  for (int a = 0; a < 3; ++a)
    x[static_cast<size_t>(a)] = math::MakeExact(math::Polynomial(q.col(a))) -
                                math::MakeExact(math::Polynomial(obstacle.center.col(a)));
  math::ExactPolynomial d = math::MakeExact(-1.0);
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b)
      d = d +
          math::MakeExact(obstacle.shape(static_cast<int>(a), static_cast<int>(b))) * x[a] * x[b];
  return math::IsPositiveExact(d);
}

// Control points of the candidates: middle (those of the fit through the means) and reach per axis.
struct ControlBoxes {
  Coefficients middle, reach;
};

ControlBoxes MakeControlBoxes(const CandidateSet& candidates) {
  const int rows = candidates.rows();
  const Eigen::MatrixXd& weights = CachedWeights(rows - 1);
  ControlBoxes boxes{weights * candidates.mean_fit(), Coefficients::Zero(rows, 3)};
  for (int n = 0; n < candidates.steps(); ++n)
    for (int a = 0; a < candidates.axes(); ++a)
      boxes.reach.col(a) += (weights * candidates.contributions(n).middleRows(a * rows, rows))
                                .cwiseAbs()
                                .rowwise()
                                .maxCoeff();
  return boxes;
}

// False when no candidate comes within `radius` of the centre: the box around all differences of
// control points stays away from the origin.
bool IsInReach(const ControlBoxes& boxes, const Coefficients& center, double radius) {
  const Eigen::Index size = std::max(boxes.middle.rows(), center.rows());
  if (size > boxes.middle.rows()) return true;
  Coefficients padded = Coefficients::Zero(size, 3);
  padded.topRows(center.rows()) = center;
  const Coefficients relative = boxes.middle - CachedWeights(static_cast<int>(size) - 1) * padded;
  const Eigen::RowVector3d low = (relative - boxes.reach).colwise().minCoeff();
  const Eigen::RowVector3d high = (relative + boxes.reach).colwise().maxCoeff();
  const double away = low.cwiseMax(-high).cwiseMax(0.0).norm();
  return !(away > radius * (1.0 + 1e-9) + 1e-9 * (1.0 + relative.cwiseAbs().maxCoeff()));
}

double RMetric(const Eigen::Vector3d& x, const Eigen::Matrix3d& R) {
  return std::sqrt(std::max(0.0, x.dot(R * x)));
}

// How far inside the grown obstacle the target was or is: below 1 is inside.
double DeepestPlace(const world::Obstacle& obstacle, const Eigen::Matrix3d& grown,
                    const std::vector<Observation>& observations, const Eigen::Vector3d& place,
                    double now) {
  double deepest = RMetric(place - obstacle.center.Position(now), grown);
  for (const Observation& o : observations)
    deepest = std::min(deepest, RMetric(o.mean - obstacle.center.Position(o.t), grown));
  return deepest;
}

}  // namespace

bool IsClear(const Coefficients& q, const HorizonObstacle& obstacle) {
  const Distance d = MakeDistance(q, obstacle);
  switch (math::DecidePositive(d.bernstein, d.error, 20)) {
    case math::Positivity::kPositive:
      return true;
    case math::Positivity::kNotPositive:
      return false;
    case math::Positivity::kUndecided:
      break;
  }
  return q.allFinite() && obstacle.center.allFinite() && IsClearExact(q, obstacle);
}

bool IsClear(const Coefficients& q, const std::vector<HorizonObstacle>& obstacles, int* hit) {
  const int count = static_cast<int>(obstacles.size());
  const int first = *hit >= 0 && *hit < count ? *hit : 0;
  for (int i = 0; i < count; ++i) {
    *hit = i == 0 ? first : (i <= first ? i - 1 : i);
    if (!IsClear(q, obstacles[static_cast<size_t>(*hit)])) return false;
  }
  *hit = -1;
  return true;
}

Nearest NearestApproach(const Coefficients& q, const HorizonObstacle& obstacle, int samples) {
  Nearest nearest{std::numeric_limits<double>::infinity(), 0.0};
  const auto at = [](const Coefficients& p, double tau) {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (Eigen::Index k = p.rows(); k-- > 0;) x = x * tau + p.row(k).transpose();
    return x;
  };
  const auto look = [&](double tau) {
    const double d = RMetric(at(q, tau) - at(obstacle.center, tau), obstacle.shape);
    if (d < nearest.distance) nearest = {d, tau};
  };
  for (int i = 0; i <= samples; ++i) look(static_cast<double>(i) / samples);
  for (double step = 0.5 / samples; step > 1e-4; step *= 0.5) {
    const double middle = nearest.tau;
    look(std::max(0.0, middle - step));
    look(std::min(1.0, middle + step));
  }
  return nearest;
}

HorizonObstacle Scaled(const HorizonObstacle& obstacle, double factor) {
  return {obstacle.id, obstacle.center, obstacle.shape / (factor * factor)};
}

std::vector<HorizonObstacle> PrepareObstacles(const std::vector<world::Obstacle>& obstacles,
                                              const std::vector<Observation>& observations,
                                              const CandidateSet& candidates, double now,
                                              double growth, const PredictorConfig& config) {
  const ControlBoxes boxes = MakeControlBoxes(candidates);
  const Eigen::Vector3d place = candidates.mean_fit().row(0);
  std::vector<HorizonObstacle> prepared;
  for (const world::Obstacle& obstacle : obstacles) {
    // An R that is not positive definite bounds no body.
    if (Eigen::LLT<Eigen::Matrix3d>(obstacle.shape).info() != Eigen::Success) continue;
    const double trace = obstacle.shape.inverse().trace();  // sum of the squared semi-axes
    const Coefficients center =
        obstacle.center.Reparametrised(now, candidates.horizon()).coefficients;
    if (center.rows() > 15 || !center.allFinite()) continue;
    if (!IsInReach(boxes, center, std::sqrt(trace) + growth)) continue;
    const Eigen::Matrix3d grown =
        growth > 0.0 ? world::Inflated(obstacle.shape, growth) : obstacle.shape;
    const double deepest = DeepestPlace(obstacle, grown, observations, place, now);
    const double factor = std::min(1.0, deepest * (1.0 - config.overlap_tolerance));
    if (!(factor >= config.smallest_shrink)) continue;
    HorizonObstacle whole{obstacle.id, center, grown};
    prepared.push_back(factor < 1.0 ? Scaled(whole, factor) : std::move(whole));
  }
  return prepared;
}

}  // namespace chase::prediction
