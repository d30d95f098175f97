#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "services/prediction/candidate_set.h"
#include "services/prediction/clearance.h"
#include "services/prediction/pack_kernels.h"

namespace chase::prediction {

/// All candidates as sums of three entries: the observations are split in three parts, and delta of
/// a candidate is the sum of an arrangement of each, a row, a group and a point. Groups and points
/// fit into the lanes of one vector block. Rows take the observations that move the end of the
/// prediction most, points those that move it least, so that candidates of one row and group stay
/// close together and can be judged by a ball around them.
class CandidateTable {
 public:
  explicit CandidateTable(const CandidateSet& candidates, const Kernels& kernels = BestKernels());

  int rows() const { return rows_.size; }
  int groups() const { return groups_.size; }  ///< at most kLanes
  int points() const { return points_.size; }  ///< at most kLanes
  const CandidateSet& candidates() const { return candidates_; }

  Choice ChoiceOf(int row, int group, int point) const;

  /// Lower bounds of the cost: of whole rows, of the groups of a row, of the points of a group. In
  /// single precision with a margin for its rounding. Both parts of the cost are sums of squares
  /// of images of delta, and for a ball of such images the least norm is known.
  std::vector<float> RowBounds() const;
  /// Costs of the middles of the rows, about.
  std::vector<float> RowMiddles() const;
  using Lanes = std::array<float, kLanes>;
  Lanes GroupBounds(int row) const;
  Lanes PointBounds(int row, int group, uint32_t wanted) const;

  /// The inside of an obstacle at one time, for all candidates. Whitened by R = L L',
  /// y = L' (q(tau) - c(tau)), the obstacle is the unit sphere.
  struct Blocker {
    Eigen::Matrix3Xf rows, groups;  // y of the arrangements; the middle of the candidates in rows
    std::array<float, 3 * kLanes> group_table, point_table;
    float group_limit, point_limit;  // squared radii of what is inside in spite of rounding
  };
  Blocker MakeBlocker(const HorizonObstacle& obstacle, double tau) const;
  /// Those of the `wanted` groups (a bit each) whose every candidate is inside.
  uint32_t BlockedGroups(const Blocker& blocker, int row, uint32_t wanted) const;
  uint32_t BlockedPoints(const Blocker& blocker, int row, int group, uint32_t wanted) const;

 private:
  struct Part {
    std::vector<int> steps;
    int size = 1;  // arrangements
  };
  Part TakeSteps(int most, std::vector<int>* steps) const;
  // Columns sum_n images[n](:, V_n) of the arrangements of a part, images in the order of steps.
  template <class Matrix>
  Matrix Sums(const Part& part, const std::vector<Matrix>& images) const;
  std::vector<float> ForAllRows(const SquaresTerm& sum, const SquaresTerm& exponent) const;
  void MakeImages();

  const CandidateSet& candidates_;
  const Kernels& kernels_;
  Part rows_, groups_, points_;
  // Images of the arrangements, for both parts of the cost, one below the other.
  Eigen::MatrixXf row_images_, group_images_;
  std::vector<float> group_table_, point_table_;
  Eigen::VectorXf point_center_, all_center_;
  SquaresTerm sum_, exponent_;             // radius: rounding alone
  float point_radius_[2], all_radius_[2];  // of the balls, in the two parts of the cost
};

}  // namespace chase::prediction
