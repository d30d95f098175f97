// A planner of one's own, as an example: keeps the desired distance behind the target along its
// path, and knows nothing of obstacles. What it takes to join the comparison:
//
//   1. A class with Plan() and IsCertified() (services/planning/planner.h): a request in, a plan
//   out.
//   2. A Registration: its name and how to make it.
//   3. This file's name in baselines.cmake.
//
// Then: build/bin/chase-compare --planners chase,follow_behind --scenarios S1,S12
//
// The contract (test/baselines/contract_test.cpp): the plan starts at request.start in position,
// velocity and acceleration; the same request gets the same plan whatever was asked before; nothing
// is thrown; a verdict claims no more than what holds.

#include <cmath>

#include "test/baselines/registry.h"
#include "test/baselines/rival.h"

namespace chase::baselines {
namespace {

using Eigen::Vector3d;

/// Quintic in tau from a state to a position and velocity with no acceleration at the end.
world::Trajectory Quintic(const world::State& from, const Vector3d& p, const Vector3d& v, double t0,
                          double T) {
  world::Trajectory plan{t0, T, Eigen::MatrixXd::Zero(6, 3)};
  const Vector3d c0 = from.p, c1 = T * from.v, c2 = 0.5 * T * T * from.a;
  const Vector3d P = p - c0 - c1 - c2, V = T * v - c1 - 2.0 * c2, A = -2.0 * c2;
  plan.coefficients.row(0) = c0.transpose();
  plan.coefficients.row(1) = c1.transpose();
  plan.coefficients.row(2) = c2.transpose();
  plan.coefficients.row(3) = (10.0 * P - 4.0 * V + 0.5 * A).transpose();
  plan.coefficients.row(4) = (-15.0 * P + 7.0 * V - A).transpose();
  plan.coefficients.row(5) = (6.0 * P - 3.0 * V + 0.5 * A).transpose();
  return plan;
}

class FollowBehind : public Rival {
 public:
  using Rival::Rival;

  planning::PlanResult Plan(const planning::PlanRequest& request) override {
    if (!IsSound(request)) return KeepOrBrake(config_, request, "the request is not finite");
    // Where the target will be and which way it will go at the end of the horizon.
    const double end = request.t0 + request.horizon;
    const Vector3d q = request.target.Position(end), v = request.target.Velocity(end);
    const Vector3d ahead = v.norm() > 0.05 ? v.normalized() : Vector3d::UnitX();
    const Vector3d goal = q - config_.desired_distance * ahead;
    // Answer() looks at the plan densely and finds the verdict that it deserves. A planner that
    // proves its plans itself sets PlanResult::verdict and needs no Rival.
    return Answer(config_, request, {Quintic(request.start, goal, v, request.t0, request.horizon)});
  }
};

// The Setup holds the scenario's PlannerConfig: desired_distance, drone_radius, limits.
const Registration kFollowBehind("follow_behind", [](const Setup& setup) {
  return std::make_unique<FollowBehind>(setup.config);
});

}  // namespace
}  // namespace chase::baselines
