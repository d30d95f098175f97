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
      : plan_(plan), problem_(problem), sight_from_(sight_from) {}

  // Asks all of the obstacle where it might matter; adds the proofs to `proofs`, if there are to be
  // any.
  bool IsOff(const Ellipsoid& e, std::vector<Proof>* proofs) const {
    const bool sight = std::max(sight_from_, e.sight_from) < 1.0;
    if (e.safety_from > 0.0 && !Leaves(plan_, e)) return false;
    return Prove(e, *e.body, false, e.safety_from, proofs) &&
           (!sight || Prove(e, *e.body, true, std::max(sight_from_, e.sight_from), proofs));
  }

 private:
  bool Prove(const Ellipsoid& e, const world::Body& body, bool of_sight, double from,
             std::vector<Proof>* proofs) const {
    const world::Ball drone =
        DroneBall(plan_, of_sight ? e.sight_share * problem_.sight_radius : e.safety_radius);
    const world::Ball target = TargetBall(problem_, e.sight_share);
    world::SeparationResult result =
        world::Separate(drone, of_sight ? &target : nullptr, body, from, 1.0);
    if (result.kept != world::Kept::kOff) return false;
    if (!proofs) return true;
    Proof proof{e.id, of_sight, from, drone.radius[0], math::Polynomial::Zero(2), {}, HUGE_VAL};
    if (of_sight) proof.target_radius = target.radius;
    for (const world::Separation& s : result.certificate)
      proof.room =
          std::min(proof.room, world::ProvenRoom(s, drone, of_sight ? &target : nullptr, body));
    proof.separations = std::move(result.certificate);
    proofs->push_back(std::move(proof));
    return true;
  }

  const Curve& plan_;
  const Problem& problem_;
  double sight_from_;
};

}  // namespace

world::Body BodyOf(const world::Obstacle& obstacle, const Problem& problem) {
  return world::MakeBody(obstacle, problem.t0, problem.duration, problem.sigmas);
}

world::Ball DroneBall(const Curve& plan, double radius) {
  return {plan, math::Polynomial::Constant(1, radius)};
}

world::Ball TargetBall(const Problem& problem, double share) {
  math::Polynomial radius = share * problem.target_growth;
  radius[0] += share * problem.sight_radius;
  return {problem.target, radius};
}

bool StaysOff(const Curve& plan, const Problem& problem, double sight_from, int* first) {
  const Prover prover(plan, problem, sight_from);
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
  const Prover prover(plan, problem, sight_from);
  std::vector<Proof> proofs;
  for (const Ellipsoid& e : problem.obstacles)
    if (e.body && !prover.IsOff(e, &proofs)) return std::nullopt;
  if (problem.target_body && !prover.IsOff(*problem.target_body, &proofs)) return std::nullopt;
  return proofs;
}

}  // namespace chase::planning
