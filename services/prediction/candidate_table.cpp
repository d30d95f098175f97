#include "services/prediction/candidate_table.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace chase::prediction {
namespace {

constexpr double kFloatRounding = 0x1p-24;

// f(delta) = constant + ||factor delta + shift||^2 from a quadratic that is bounded below.
struct SumOfSquares {
  Eigen::MatrixXd factor;
  Eigen::VectorXd shift;
  double constant;
};

// From H = P' L D L' P; directions in which f does not grow are left out, which only lowers it.
SumOfSquares MakeSumOfSquares(const CandidateSet::Quadratic& f) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(f.hessian_half);
  const Eigen::VectorXd d = ldlt.vectorD();
  const Eigen::MatrixXd P =
      ldlt.transpositionsP() * Eigen::MatrixXd::Identity(f.gradient.size(), f.gradient.size());
  const Eigen::MatrixXd U = ldlt.matrixU() * P;
  const Eigen::VectorXd g = ldlt.matrixL().solve(0.5 * P * f.gradient);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < d.size(); ++i)
    if (d[i] > 1e-13 * d.cwiseAbs().maxCoeff()) kept.push_back(i);
  SumOfSquares squares{Eigen::MatrixXd(kept.size(), d.size()), Eigen::VectorXd(kept.size()), 0.0};
  for (size_t i = 0; i < kept.size(); ++i) {
    const auto to = static_cast<Eigen::Index>(i);
    squares.factor.row(to) = std::sqrt(d[kept[i]]) * U.row(kept[i]);
    squares.shift[to] = g[kept[i]] / std::sqrt(d[kept[i]]);
  }
  squares.constant = f.constant - squares.shift.squaredNorm();
  return squares;
}

// Steps by how far their points move the end of the prediction, the farthest first.
std::vector<int> StepsByReach(const CandidateSet& candidates) {
  std::vector<std::pair<double, int>> reach;
  const int n = candidates.rows();
  for (int step = 0; step < candidates.steps(); ++step) {
    Eigen::ArrayXd squared = Eigen::ArrayXd::Zero(candidates.samples());
    for (int a = 0; a < candidates.axes(); ++a)
      squared += candidates.contributions(step)
                     .middleRows(a * n, n)
                     .colwise()
                     .sum()
                     .transpose()
                     .array()
                     .square();
    reach.emplace_back(-squared.maxCoeff(), step);
  }
  std::sort(reach.begin(), reach.end());
  std::vector<int> steps;
  for (const auto& entry : reach) steps.push_back(entry.second);
  return steps;
}

// Columns to [dimension][lane], zero-padded; the last block of them begins at column `first`.
void ToLanes(const Eigen::MatrixXf& columns, Eigen::Index first, float* lanes) {
  const Eigen::Index count = std::min<Eigen::Index>(kLanes, columns.cols() - first);
  std::fill(lanes, lanes + columns.rows() * kLanes, 0.0F);
  for (Eigen::Index j = 0; j < count; ++j)
    for (Eigen::Index d = 0; d < columns.rows(); ++d) lanes[d * kLanes + j] = columns(d, first + j);
}

template <class Matrix>
double Radius(const Matrix& columns) {
  return 1.00001 * static_cast<double>(
                       (columns.colwise() - columns.rowwise().mean()).colwise().norm().maxCoeff());
}

// What single precision may be off by, at most, in the norm of a sum of such columns; each is
// itself a sum over a part of `steps` steps.
template <class Matrix>
double Rounding(int steps, std::initializer_list<const Matrix*> parts) {
  double largest = 0.0;
  for (const Matrix* part : parts)
    if (part->size() > 0) largest += static_cast<double>(part->cwiseAbs().maxCoeff());
  return 1.01 * (8.0 + steps) * kFloatRounding * largest *
         std::sqrt(static_cast<double>((*parts.begin())->rows()));
}

uint32_t Below(float limit, uint32_t bits) { return limit > 0.0F ? bits : 0U; }

}  // namespace

CandidateTable::CandidateTable(const CandidateSet& candidates, const Kernels& kernels)
    : candidates_(candidates), kernels_(kernels) {
  std::vector<int> steps = StepsByReach(candidates);
  points_ = TakeSteps(kLanes, &steps);
  groups_ = TakeSteps(kLanes, &steps);
  rows_ = TakeSteps(std::numeric_limits<int>::max(), &steps);
  MakeImages();
}

// The last of the steps, as many as keep to `most` arrangements.
CandidateTable::Part CandidateTable::TakeSteps(int most, std::vector<int>* steps) const {
  Part part;
  while (!steps->empty() && part.size <= most / candidates_.samples() && part.steps.size() < 16) {
    part.steps.push_back(steps->back());
    steps->pop_back();
    part.size *= candidates_.samples();
  }
  return part;
}

template <class Matrix>
Matrix CandidateTable::Sums(const Part& part, const std::vector<Matrix>& images) const {
  Matrix sums = Matrix::Zero(images.front().rows(), part.size);
  Eigen::Index filled = 1;
  for (const int step : part.steps) {
    const Matrix& image = images[static_cast<size_t>(step)];
    for (Eigen::Index i = candidates_.samples(); i-- > 0;)
      for (Eigen::Index j = 0; j < filled; ++j)
        sums.col(i * filled + j) = sums.col(j) + image.col(i);
    filled *= candidates_.samples();
  }
  return sums;
}

void CandidateTable::MakeImages() {
  const SumOfSquares parts[] = {MakeSumOfSquares(candidates_.smoothness()),
                                MakeSumOfSquares(candidates_.exponent())};
  const Eigen::Index dims[] = {parts[0].factor.rows(), parts[1].factor.rows()};
  const Eigen::Index total = dims[0] + dims[1];
  Eigen::MatrixXd factor(total, candidates_.dims());
  Eigen::VectorXd shift(total);
  factor << parts[0].factor, parts[1].factor;
  shift << parts[0].shift, parts[1].shift;
  std::vector<Eigen::MatrixXf> images;
  for (int n = 0; n < candidates_.steps(); ++n)
    images.emplace_back((factor * candidates_.contributions(n)).cast<float>());
  row_images_ = Sums(rows_, images).colwise() + shift.cast<float>();
  group_images_ = Sums(groups_, images);
  const Eigen::MatrixXf points = Sums(points_, images);
  point_center_ = points.rowwise().mean();
  all_center_ = point_center_ + group_images_.rowwise().mean();
  SquaresTerm* const terms[] = {&sum_, &exponent_};
  for (int i = 0; i < 2; ++i) {
    const Eigen::Index from = i == 0 ? 0 : dims[0], n = dims[i];
    *terms[i] = {static_cast<int>(n), static_cast<float>(parts[i].constant), 0.0F};
    if (n == 0) continue;
    const Eigen::MatrixXf row = row_images_.middleRows(from, n),
                          group = group_images_.middleRows(from, n),
                          point = points.middleRows(from, n);
    const double rounding = Rounding(candidates_.steps(), {&row, &group, &point});
    const double radius = Radius(point) + rounding;
    terms[i]->radius = static_cast<float>(rounding);
    point_radius_[i] = static_cast<float>(radius);
    all_radius_[i] = static_cast<float>(radius + Radius(group));
  }
  group_table_.resize(static_cast<size_t>(total * kLanes));
  point_table_.resize(group_table_.size());
  ToLanes(group_images_, 0, group_table_.data());
  ToLanes(points, 0, point_table_.data());
}

Choice CandidateTable::ChoiceOf(int row, int group, int point) const {
  Choice choice(static_cast<size_t>(candidates_.steps()));
  for (const auto& [part, number] :
       {std::pair(&rows_, row), std::pair(&groups_, group), std::pair(&points_, point)}) {
    int rest = number;
    for (const int step : part->steps) {
      choice[static_cast<size_t>(step)] = rest % candidates_.samples();
      rest /= candidates_.samples();
    }
  }
  return choice;
}

std::vector<float> CandidateTable::ForAllRows(const SquaresTerm& sum,
                                              const SquaresTerm& exponent) const {
  const int blocks = (rows() + kLanes - 1) / kLanes;
  std::vector<float> out(static_cast<size_t>(blocks * kLanes)), lanes(group_table_.size());
  for (int block = 0; block < blocks; ++block) {
    ToLanes(row_images_, block * kLanes, lanes.data());
    kernels_.cost_bounds(sum, exponent, lanes.data(), all_center_.data(), ~0U,
                         out.data() + block * kLanes);
  }
  out.resize(static_cast<size_t>(rows()));
  return out;
}

std::vector<float> CandidateTable::RowBounds() const {
  SquaresTerm sum = sum_, exponent = exponent_;
  sum.radius = all_radius_[0];
  exponent.radius = all_radius_[1];
  return ForAllRows(sum, exponent);
}

std::vector<float> CandidateTable::RowMiddles() const { return ForAllRows(sum_, exponent_); }

CandidateTable::Lanes CandidateTable::GroupBounds(int row) const {
  SquaresTerm sum = sum_, exponent = exponent_;
  sum.radius = point_radius_[0];
  exponent.radius = point_radius_[1];
  const Eigen::VectorXf origin = row_images_.col(row) + point_center_;
  Lanes bounds;
  kernels_.cost_bounds(sum, exponent, group_table_.data(), origin.data(), ~0U, bounds.data());
  return bounds;
}

CandidateTable::Lanes CandidateTable::PointBounds(int row, int group, uint32_t wanted) const {
  const Eigen::VectorXf origin = row_images_.col(row) + group_images_.col(group);
  Lanes bounds;
  kernels_.cost_bounds(sum_, exponent_, point_table_.data(), origin.data(), wanted, bounds.data());
  return bounds;
}

CandidateTable::Blocker CandidateTable::MakeBlocker(const HorizonObstacle& obstacle,
                                                    double tau) const {
  const int n = candidates_.rows();
  const Eigen::Matrix3d Lt = obstacle.shape.llt().matrixU();
  Eigen::VectorXd powers(std::max<Eigen::Index>(n, obstacle.center.rows()));
  powers[0] = 1.0;
  for (Eigen::Index k = 1; k < powers.size(); ++k) powers[k] = powers[k - 1] * tau;
  const Eigen::Vector3d middle =
      Lt * (candidates_.mean_fit().transpose() * powers.head(n) -
            obstacle.center.transpose() * powers.head(obstacle.center.rows()));
  std::vector<Eigen::Matrix3Xf> images;
  for (int step = 0; step < candidates_.steps(); ++step) {
    Eigen::Matrix3Xd at = Eigen::Matrix3Xd::Zero(3, candidates_.samples());
    for (int a = 0; a < candidates_.axes(); ++a)
      at.row(a) = powers.head(n).transpose() * candidates_.contributions(step).middleRows(a * n, n);
    images.emplace_back((Lt * at).cast<float>());
  }
  Blocker blocker;
  blocker.rows = Sums(rows_, images).colwise() + middle.cast<float>();
  blocker.groups = Sums(groups_, images);
  const Eigen::Matrix3Xf points = Sums(points_, images);
  const Eigen::Vector3f center = points.rowwise().mean();
  const double inside =
      1.0 - 1e-6 - Rounding(candidates_.steps(), {&blocker.rows, &blocker.groups, &points});
  const double group_inside = inside - Radius(points);
  ToLanes(blocker.groups.colwise() + center, 0, blocker.group_table.data());
  ToLanes(points, 0, blocker.point_table.data());
  blocker.point_limit = static_cast<float>(inside > 0.0 ? inside * inside : -1.0);
  blocker.group_limit = static_cast<float>(group_inside > 0.0 ? group_inside * group_inside : -1.0);
  return blocker;
}

uint32_t CandidateTable::BlockedGroups(const Blocker& blocker, int row, uint32_t wanted) const {
  return Below(blocker.group_limit,
               kernels_.inside(blocker.group_table.data(), blocker.rows.col(row).data(), wanted,
                               blocker.group_limit));
}

uint32_t CandidateTable::BlockedPoints(const Blocker& blocker, int row, int group,
                                       uint32_t wanted) const {
  const Eigen::Vector3f origin = blocker.rows.col(row) + blocker.groups.col(group);
  return Below(blocker.point_limit, kernels_.inside(blocker.point_table.data(), origin.data(),
                                                    wanted, blocker.point_limit));
}

}  // namespace chase::prediction
