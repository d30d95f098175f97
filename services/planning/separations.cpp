#include "services/planning/separations.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"
#include "services/planning/candidate_set.h"

namespace chase::planning {
namespace {

// A box that holds a plan and, if asked, the line of sight; none where its degree is too high.
std::optional<Box> BoxAround(const Curve& plan) {
  if (plan.rows() > 7) return std::nullopt;
  return BoxOf(ToPoints(plan, 6), 7, 1e-6);
}

Box Union(const Box& a, const Box& b) { return {a.low.min(b.low), a.high.max(b.high)}; }

// A plan that starts within an obstacle's hard shape has to leave it: along the way out at its
// start the distance never shrinks.
bool Leaves(const Curve& plan, const Ellipsoid& e) {
  const Eigen::Vector3d offset = (plan.row(0) - e.center.row(0)).transpose();
  const Eigen::Vector3d out = world::Outwards(*e.body, offset);
  const Eigen::Index n = std::max(plan.rows(), e.center.rows());
  math::Polynomial along = math::Polynomial::Zero(n);
  along.head(plan.rows()) = plan * out;
  along.head(e.center.rows()) -= e.center * out;
  math::Polynomial rate = math::Derivative(along);
  double scale = 1.0;  // of tau, to [0, safety_from]
  for (Eigen::Index k = 0; k < rate.size(); ++k, scale *= e.safety_from) rate[k] *= scale;
  return math::PowerToBernstein(rate).minCoeff() >= 0.0;
}

class Prover {
 public:
  Prover(const Curve& plan, const Problem& problem, double sight_from)
      : problem_(problem),
        sight_from_(sight_from),
        drone_(DroneBall(plan, 0.0)),
        target_(TargetBall(problem, 1.0)) {}

  // Asks all of the obstacle where it might matter; adds the proofs to `proofs`, if there are to be
  // any.
  bool IsOff(const Ellipsoid& e, std::vector<Proof>* proofs) {
    const bool sight = std::max(sight_from_, e.sight_from) < 1.0;
    if (e.safety_from > 0.0 && !Leaves(drone_.center, e)) return false;
    return Prove(e, false, e.safety_from, proofs) &&
           (!sight || Prove(e, true, std::max(sight_from_, e.sight_from), proofs));
  }

 private:
  bool Prove(const Ellipsoid& e, bool of_sight, double from, std::vector<Proof>* proofs) {
    drone_.radius[0] = of_sight ? e.sight_share * problem_.sight_radius : e.safety_radius;
    if (of_sight) target_.radius = TargetRadius(problem_, e.sight_share);
    world::SeparationResult result =
        world::Separate(drone_, of_sight ? &target_ : nullptr, *e.body, from, 1.0);
    if (result.kept != world::Kept::kOff) return false;
    if (!proofs) return true;
    proofs->push_back({e.id, of_sight, from, drone_.radius[0], math::Polynomial::Zero(2),
                       std::move(result.certificate), result.room});
    if (of_sight) proofs->back().target_radius = target_.radius;
    return true;
  }

  const Problem& problem_;
  double sight_from_;
  world::Ball drone_, target_;  ///< of radii that are set for each obstacle
};

}  // namespace

world::Ball DroneBall(const Curve& plan, double radius) {
  return {plan, math::Polynomial::Constant(1, radius)};
}

math::Polynomial TargetRadius(const Problem& problem, double share) {
  math::Polynomial radius = share * problem.target_growth;
  radius[0] += share * problem.sight_radius;
  return radius;
}

world::Ball TargetBall(const Problem& problem, double share) {
  return {problem.target, TargetRadius(problem, share)};
}

bool StaysOff(const Curve& plan, const Problem& problem, double sight_from, int* first) {
  Prover prover(plan, problem, sight_from);
  const std::optional<Box> box = BoxAround(plan), seen = BoxAround(problem.target);
  const auto is_off = [&](const Ellipsoid& e) {
    if (!e.body) return true;
    const bool far = box && seen &&
                     !MayTouch(Union(*box, *seen), e.center, e.safety_half.max(e.sight_half), 1.0);
    return far || prover.IsOff(e, nullptr);
  };
  const int n = static_cast<int>(problem.obstacles.size());
  const auto is_off_at = [&](int j) {
    const bool off = is_off(problem.obstacles[static_cast<size_t>(j)]);
    if (!off && first) *first = j;
    return off;
  };
  if (first && *first >= 0 && *first < n && !is_off_at(*first)) return false;
  if (problem.target_body && !is_off(*problem.target_body)) return false;
  if (problem.reach && Contains(*problem.reach, plan))
    return std::all_of(problem.near.begin(), problem.near.end(), is_off_at);
  for (int j = 0; j < n; ++j)
    if (!is_off_at(j)) return false;
  return true;
}

std::optional<std::vector<Proof>> ProveOff(const Curve& plan, const Problem& problem,
                                           double sight_from) {
  Prover prover(plan, problem, sight_from);
  std::vector<Proof> proofs;
  proofs.reserve(2 * problem.obstacles.size() + 1);
  for (const Ellipsoid& e : problem.obstacles)
    if (e.body && !prover.IsOff(e, &proofs)) return std::nullopt;
  if (problem.target_body && !prover.IsOff(*problem.target_body, &proofs)) return std::nullopt;
  return proofs;
}

}  // namespace chase::planning
