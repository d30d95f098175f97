#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"
#include "services/prediction/candidate_set.h"

namespace chase::prediction {

/// An obstacle over the horizon: centre as a polynomial of tau, shape R in 1/m^2.
struct HorizonObstacle {
  int id = 0;
  Coefficients center;
  Eigen::Matrix3d shape;
};

/// ||q(tau) - c(tau)||_R^2 > 1 for all tau in [0,1], certified: a floating-point test in Bernstein
/// form with a proven rounding margin, and exact arithmetic for what it leaves open. Jeon 2021,
/// section III-B (there t in (0,T] and d_q(0) > 1).
bool IsClear(const Coefficients& q, const HorizonObstacle& obstacle);

/// The same for all; the index of an obstacle that is hit goes to `hit` (-1: none). The obstacle
/// that `hit` names on entry is tested first.
bool IsClear(const Coefficients& q, const std::vector<HorizonObstacle>& obstacles, int* hit);

/// Smallest ||q - c||_R over `samples` + 1 times, refined by halving steps, and the time tau where
/// it is.
struct Nearest {
  double distance, tau;
};
Nearest NearestApproach(const Coefficients& q, const HorizonObstacle& obstacle, int samples);

/// The obstacle with its semi-axes times `factor`.
HorizonObstacle Scaled(const HorizonObstacle& obstacle, double factor);

/// Obstacles as the prediction of a body of radius `growth` m meets them:
/// - grown by `growth`;
/// - one that covers an observation or the target's place at `now` is shrunk until that lies
///   outside by `overlap_tolerance` of its size, or left out when less than `smallest_shrink` of
///   it would remain: the target is not inside an obstacle, so the obstacle is drawn too large or
///   is the target itself;
/// - those out of reach of every candidate are left out.
std::vector<HorizonObstacle> PrepareObstacles(const std::vector<world::Obstacle>& obstacles,
                                              const std::vector<Observation>& observations,
                                              const CandidateSet& candidates, double now,
                                              double growth, const PredictorConfig& config);

}  // namespace chase::prediction
