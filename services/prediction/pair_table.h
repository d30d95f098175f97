#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/prediction/candidate_set.h"
#include "services/prediction/clearance.h"

namespace chase::prediction {

/// The candidates as pairs: the observations are split in two halves, a row is an arrangement of
/// one half, a column one of the other, and delta is the sum of two half-sums. Costs and places of
/// a pair are inner products of table entries. Rows take the observations that move the end of the
/// prediction most, so that the candidates of one row stay close together.
class PairTable {
 public:
  explicit PairTable(const CandidateSet& candidates);

  int rows() const { return static_cast<int>(rows_.delta.cols()); }
  int columns() const { return static_cast<int>(columns_.delta.cols()); }
  int blocks() const { return blocks_; }  ///< of kLanes columns
  double Cost(int row, int column) const;
  double Exponent(int row, int column) const;  ///< log w_q + B
  Choice ChoiceOf(int row, int column) const;
  const CandidateSet& candidates() const { return candidates_; }

  /// Lower bounds of the cost of every pair, times `scale`:
  ///   J >= A + e^x0 (1 + x - x0),  x = log w_q + B,
  /// the tangent of the convex exponential at x0; sharp for candidates with x near x0. Bounds are
  /// quadratic in delta: row[i] + own(j) + factors(i)' delta_j, in single precision, with a margin
  /// for its rounding in row[i].
  struct Bounds {
    double tangent = 0.0;  ///< x0
    double scale = 1.0;    ///< keeps the numbers within single precision
    std::vector<double> row;
    std::vector<float> own, factors;
  };
  Bounds MakeBounds(double tangent) const;
  /// The rest of the bounds of one row to `out` (blocks() x kLanes); returns the least.
  float FillRow(const Bounds& bounds, int row, float* out) const;

  /// A place inside an obstacle at one time, for all pairs at once. Whitened by R = L L',
  /// y = L' (q(tau) - c(tau)), the obstacle is the unit sphere.
  struct Blocker {
    Eigen::Matrix3Xd row_points;       ///< y of each row's half-sum and of the mean fit
    std::vector<float> column_points;  ///< [block][3][lane]
    float limit = 0.0F;                ///< squared radius of what is inside in spite of rounding
    std::vector<int> blocked_rows;     ///< rows whose every pair is inside
  };
  Blocker MakeBlocker(const HorizonObstacle& obstacle, double tau) const;
  /// Zeroes alive[j] where the pair is known to collide; returns how many stay.
  int Mask(const Blocker& blocker, int row, int* alive) const;

 private:
  // Sums of contributions over half of the steps, one per arrangement of that half.
  struct Half {
    std::vector<int> steps;
    Eigen::MatrixXd delta;                 // column per arrangement
    Eigen::VectorXd smoothness, exponent;  // own part of A and of x
  };
  Half MakeHalf(std::vector<int> steps) const;

  const CandidateSet& candidates_;
  Half rows_, columns_;
  Eigen::MatrixXd row_smoothness_, row_exponent_;  // 2 H delta of each row: the cross terms
  int blocks_ = 0;
  std::vector<float> column_table_;  // column deltas, [block][dimension][lane]
};

}  // namespace chase::prediction
