#pragma once

#include <vector>

#include "test/baselines/nlp.h"
#include "test/baselines/rival.h"

namespace chase::baselines {

struct NaegeliParameters {
  double weight_distance = 1.0, weight_sight = 5.0, weight_potential = 0.3, weight_effort = 0.03;
  double weight_angle = 0.5, angle = 0.1;  ///< viewing angle above the level, rad
  double jerk_share = 0.3;                 ///< weight of changes of acceleration over the effort's
  double weight_slack = 1000.0;
  double steepness = 6.0, beta = 1.3;  ///< of the collision potential
  double sight_margin = 0.2;
  double desired_distance = 3.0;  ///< m
  double pair_reach = 2.0;        ///< see PeninParameters
  int stages = 20;
};

/// Model-predictive framing of the target: visibility is a soft cost, safety a constraint with
/// slack. Double integrator, acceleration constant over each stage. Variables: accelerations, x y z
/// by turns, then the slack.
class FramingNlp : public Nlp {
 public:
  FramingNlp(const NaegeliParameters& parameters, const planning::PlannerConfig& config,
             const planning::PlanRequest& request, const Eigen::VectorXd& warm);

  int n_variables() const override { return 3 * parameters_.stages + 1; }
  int n_constraints() const override { return n_pairs_ + 8 * parameters_.stages; }
  double Cost(const Eigen::VectorXd& x, Eigen::VectorXd* gradient) const override;
  void Constraints(const Eigen::VectorXd& x, Eigen::VectorXd* g, Rows* jacobian) const override;
  void Bounds(Eigen::VectorXd* low, Eigen::VectorXd* high) const override;

  /// Largest violation of what the slack does not cover.
  double HardViolation(const Eigen::VectorXd& x) const;
  Pieces ToPieces(const Eigen::VectorXd& x) const;

 private:
  struct Stages {
    std::vector<Eigen::Vector3d> p, v;  ///< at stages 1..N
  };
  Stages Roll(const Eigen::VectorXd& x) const;
  /// Adds factor * slope' dp_k/dx to a row; k counts from 1.
  void Spread(int k, const Eigen::Vector3d& slope, double* row) const;
  double StageCost(int k, const Eigen::Vector3d& p, Eigen::Vector3d* slope) const;
  double Effort(const Eigen::VectorXd& x, Eigen::VectorXd* gradient) const;

  NaegeliParameters parameters_;
  planning::PlannerConfig config_;
  double step_, t0_;
  world::State start_;
  std::vector<Body> bodies_;
  std::vector<Eigen::Vector3d> target_;        ///< at stages 1..N
  std::vector<std::vector<int>> constrained_;  ///< bodies, by stage
  int n_pairs_ = 0;
};

}  // namespace chase::baselines
