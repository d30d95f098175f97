#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::track {

/// What is known of a track before a set of measurements.
struct Prior {
  double existence = 1.0;  ///< probability that what it follows is there
  double detection = 1.0;  ///< probability of a measurement of it, if so: from what is in view
};

/// What a set of measurements tells.
struct Association {
  /// Row i: track i exists and has yielded measurement j; the last column: none of them, or it does
  /// not exist. Rows have the sum 1.
  Eigen::MatrixXd probability;
  Eigen::VectorXd existence;  ///< of each track, afterwards
  Eigen::VectorXd fresh;      ///< of each measurement, that it is of none of the tracks
};

/// Joint integrated probabilistic data association (Musicki and Evans 2004): a track yields at most
/// one measurement and a measurement comes from one track at most, or from something new. `ratio`,
/// tracks x measurements: density of measurement j if it is track i's over that of clutter and new
/// things; 0 outside the gate. The marginals are those of belief propagation (Williams and Lau
/// 2014, "Approximate evaluation of marginal association probabilities with belief propagation"),
/// exact where no tracks share two measurements; the cost is that of some sums over `ratio`.
Association Associate(const std::vector<Prior>& tracks, const Eigen::MatrixXd& ratio);

/// For each track the measurement that is its own, or -1: the most probable pairs first, each
/// measurement once, none that is less probable than `least`.
std::vector<int> Assign(const Association& association, double least);

/// Probability that a track of existence probability `existence` is still there after dt s, where
/// tracks last `lifetime` s on average while nothing is known of them.
double Survival(double existence, double dt, double lifetime);

}  // namespace chase::track
