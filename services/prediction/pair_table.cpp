#include "services/prediction/pair_table.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "services/prediction/pack_kernels.h"

namespace chase::prediction {
namespace {

constexpr double kFloatRounding = 0x1p-24;
constexpr int kExtraRowSteps = 0;

int Power(int base, int exponent) {
  int value = 1;
  for (int i = 0; i < exponent; ++i) value *= base;
  return value;
}

// Columns to lane-wise storage [block][dimension][lane], zero-padded.
std::vector<float> ToLanes(const Eigen::MatrixXd& columns, int blocks) {
  const Eigen::Index dims = columns.rows();
  std::vector<float> lanes(static_cast<size_t>(blocks * kLanes * dims), 0.0F);
  for (Eigen::Index j = 0; j < columns.cols(); ++j)
    for (Eigen::Index d = 0; d < dims; ++d)
      lanes[static_cast<size_t>((j / kLanes * dims + d) * kLanes + j % kLanes)] =
          static_cast<float>(columns(d, j));
  return lanes;
}

// Steps by how far their points move the end of the prediction, the farthest first.
std::vector<int> StepsByReach(const CandidateSet& candidates) {
  std::vector<std::pair<double, int>> reach;
  const int n = candidates.rows();
  for (int step = 0; step < candidates.steps(); ++step) {
    Eigen::ArrayXd squared = Eigen::ArrayXd::Zero(candidates.samples());
    for (int a = 0; a < candidates.axes(); ++a)
      squared +=
          candidates.contributions(step).middleRows(a * n, n).colwise().sum().array().square();
    reach.emplace_back(-squared.maxCoeff(), step);
  }
  std::sort(reach.begin(), reach.end());
  std::vector<int> steps;
  for (const auto& entry : reach) steps.push_back(entry.second);
  return steps;
}

}  // namespace

PairTable::PairTable(const CandidateSet& candidates) : candidates_(candidates) {
  const std::vector<int> steps = StepsByReach(candidates);
  const auto half = steps.begin() + (candidates.steps() + kExtraRowSteps) / 2;
  rows_ = MakeHalf({steps.begin(), half});
  columns_ = MakeHalf({half, steps.end()});
  row_smoothness_ = 2.0 * candidates.smoothness().hessian_half * rows_.delta;
  row_exponent_ = 2.0 * candidates.exponent().hessian_half * rows_.delta;
  blocks_ = (columns() + kLanes - 1) / kLanes;
  column_table_ = ToLanes(columns_.delta, blocks_);
}

PairTable::Half PairTable::MakeHalf(std::vector<int> steps) const {
  const int samples = candidates_.samples(), size = Power(samples, static_cast<int>(steps.size()));
  Half half{std::move(steps), Eigen::MatrixXd::Zero(candidates_.dims(), size), {}, {}};
  int filled = 1;
  for (const int step : half.steps) {
    const Eigen::MatrixXd& c = candidates_.contributions(step);
    for (int i = samples - 1; i >= 0; --i)
      half.delta.middleCols(i * filled, filled) = half.delta.leftCols(filled).colwise() + c.col(i);
    filled *= samples;
  }
  const auto own = [&half](const CandidateSet::Quadratic& f) -> Eigen::VectorXd {
    const Eigen::MatrixXd image = (f.hessian_half * half.delta).colwise() + f.gradient;
    return half.delta.cwiseProduct(image).colwise().sum().transpose();
  };
  half.smoothness = own(candidates_.smoothness());
  half.exponent = own(candidates_.exponent());
  return half;
}

double PairTable::Exponent(int row, int column) const {
  return candidates_.exponent().constant + rows_.exponent[row] + columns_.exponent[column] +
         row_exponent_.col(row).dot(columns_.delta.col(column));
}

double PairTable::Cost(int row, int column) const {
  return candidates_.smoothness().constant + rows_.smoothness[row] + columns_.smoothness[column] +
         row_smoothness_.col(row).dot(columns_.delta.col(column)) +
         GuardedExp(Exponent(row, column));
}

Choice PairTable::ChoiceOf(int row, int column) const {
  Choice choice(static_cast<size_t>(candidates_.steps()));
  for (const auto& [half, number] : {std::pair(&rows_, row), std::pair(&columns_, column)}) {
    int rest = number;
    for (const int step : half->steps) {
      choice[static_cast<size_t>(step)] = rest % candidates_.samples();
      rest /= candidates_.samples();
    }
  }
  return choice;
}

PairTable::Bounds PairTable::MakeBounds(double tangent) const {
  const double slope = GuardedExpSlope(tangent);
  Bounds bounds;
  bounds.tangent = tangent;
  bounds.scale = 1.0 / std::max(1.0, slope);
  const double s = bounds.scale, e = s * slope;
  const Eigen::MatrixXd factors = s * row_smoothness_ + e * row_exponent_;
  const Eigen::VectorXd row_own = s * rows_.smoothness + e * rows_.exponent;
  const Eigen::VectorXd column_own = s * columns_.smoothness + e * columns_.exponent;
  const double base = s * (candidates_.smoothness().constant + GuardedExp(tangent)) +
                      e * (candidates_.exponent().constant - tangent);
  // Every term is off by at most dims + 4 roundings of the largest sum of absolute values.
  const double largest =
      column_own.cwiseAbs().maxCoeff() +
      factors.cwiseAbs().rowwise().maxCoeff().dot(columns_.delta.cwiseAbs().rowwise().maxCoeff());
  const double margin = 1.01 * (candidates_.dims() + 4) * kFloatRounding * largest +
                        1e-12 * (std::abs(base) + row_own.cwiseAbs().maxCoeff());
  bounds.own.assign(static_cast<size_t>(blocks_ * kLanes),
                    std::numeric_limits<float>::infinity());  // padding is never cheap
  Eigen::Map<Eigen::VectorXf>(bounds.own.data(), columns()) = column_own.cast<float>();
  bounds.factors.resize(static_cast<size_t>(factors.size()));
  Eigen::Map<Eigen::MatrixXf>(bounds.factors.data(), factors.rows(), factors.cols()) =
      factors.cast<float>();
  bounds.row.resize(static_cast<size_t>(rows()));
  Eigen::Map<Eigen::VectorXd>(bounds.row.data(), rows()) = row_own.array() + (base - margin);
  return bounds;
}

float PairTable::FillRow(const Bounds& bounds, int row, float* out) const {
  const int dims = candidates_.dims();
  return AffineRow(bounds.own.data(), column_table_.data(),
                   bounds.factors.data() + static_cast<ptrdiff_t>(row) * dims, dims, blocks_, out);
}

PairTable::Blocker PairTable::MakeBlocker(const HorizonObstacle& obstacle, double tau) const {
  const int n = candidates_.rows();
  const Eigen::Matrix3d Lt = obstacle.shape.llt().matrixU();
  Eigen::MatrixXd at = Eigen::MatrixXd::Zero(3, candidates_.dims());  // delta to place at tau
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double power = 1.0;
  for (int k = 0; k < std::max(n, static_cast<int>(obstacle.center.rows())); ++k, power *= tau) {
    if (k < n) middle += power * candidates_.mean_fit().row(k).transpose();
    if (k < obstacle.center.rows()) middle -= power * obstacle.center.row(k).transpose();
    for (int a = 0; a < candidates_.axes() && k < n; ++a) at(a, a * n + k) = power;
  }
  at = Lt * at;
  Blocker blocker;
  blocker.row_points = (at * rows_.delta).colwise() + Lt * middle;
  const Eigen::MatrixXd points = at * columns_.delta;
  blocker.column_points = ToLanes(points, blocks_);
  // Single precision errs by far less than 1e-5 of the squared magnitudes in play.
  const double scale =
      1.0 + blocker.row_points.cwiseAbs().maxCoeff() + points.cwiseAbs().maxCoeff();
  blocker.limit = static_cast<float>(1.0 - 1e-5 * scale * scale);
  const Eigen::Vector3d center = points.rowwise().mean();
  const double radius = (points.colwise() - center).colwise().norm().maxCoeff();
  for (int row = 0; row < rows(); ++row)
    if ((blocker.row_points.col(row) + center).norm() + radius < 1.0 - 1e-9)
      blocker.blocked_rows.push_back(row);
  return blocker;
}

int PairTable::Mask(const Blocker& blocker, int row, int* alive) const {
  const Eigen::Vector3f y = blocker.row_points.col(row).cast<float>();
  return MaskInside(blocker.column_points.data(), y.data(), blocker.limit, blocks_, alive);
}

}  // namespace chase::prediction
