#include "services/planning/separations.h"

#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"

namespace chase::planning {
namespace {

// A box that holds a plan; none where its degree is too high.
std::optional<Box> BoxAround(const Curve& plan) {
  if (plan.rows() > 7) return std::nullopt;
  return BoxOf(ToPoints(plan, 6), 7, 1e-6);
}

// Sorts out what is plainly far from the plan, and from the line of sight where that is asked for.
class Sieve {
 public:
  Sieve(const Curve& plan, const Problem& problem, double sight_from)
      : sight_(sight_from < kNoSight), box_(BoxAround(plan)) {
    if (!sight_ || !box_) return;
    const std::optional<Box> seen = BoxAround(problem.target);
    if (seen)
      box_ = Box{box_->low.min(seen->low), box_->high.max(seen->high)};
    else
      box_.reset();
  }

  // Of obstacles that stand for a solid.
  bool IsNear(const Ellipsoid& e) const {
    if (!e.body) return false;
    if (!box_) return true;
    return MayTouch(*box_, e.center, sight_ ? e.safety_half.max(e.sight_half) : e.safety_half, 1.0);
  }

 private:
  bool sight_;
  std::optional<Box> box_;
};

class Prover {
 public:
  Prover(const Curve& plan, const Problem& problem, double sight_from)
      : problem_(problem),
        sight_from_(sight_from),
        drone_(DroneBall(plan, 0.0)),
        eye_(drone_),
        target_(TargetBall(problem, 1.0)),
        safety_(drone_, nullptr),
        sight_(eye_, &target_) {}

  // Asks all of the obstacle where it might matter, `memory` first, if there is one; adds the
  // proofs to `proofs`, if there are to be any. The planes that keep the line of sight off keep the
  // drone's ball off, too: they prove safety where that leaves more than others do, so that the
  // least clearance has planes of its own.
  bool IsOff(const Ellipsoid& e, std::vector<Proof>* proofs, SeparationMemory* memory) {
    if (e.safety_from > 0.0 && !world::Leaves(drone_.center, *e.body, e.safety_from)) return false;
    const double from = SightFrom(e);
    const bool seen = from < kNoSight;
    world::SeparationResult sight = seen ? InSight(e, memory) : world::SeparationResult{};
    if (seen && !IsKept(sight)) return false;
    const double left = sight.room.drone - (e.safety_radius - SightRadius(e));
    if (from <= e.safety_from && left > kSlack && (!proofs || e.safety_radius + left > least_)) {
      if (!proofs) return true;
      least_ = std::min(least_, e.safety_radius + left);
      Add(e.id, e.safety_from, e.safety_radius, left, sight.certificate, proofs);
    } else {
      world::SeparationResult safety = Off(e, memory);
      if (!IsKept(safety)) return false;
      if (!proofs) return true;
      least_ = std::min(least_, e.safety_radius + safety.room.drone);
      Add(e.id, e.safety_from, e.safety_radius, safety.room.drone, std::move(safety.certificate),
          proofs);
    }
    if (!seen) return true;
    Add(e.id, from, SightRadius(e), sight.room.drone, std::move(sight.certificate), proofs);
    proofs->back().of_sight = true;
    proofs->back().target_radius = TargetRadius(problem_, e.sight_share);
    return true;
  }

  // Of an obstacle that is not off: when it was touched, if that is known.
  double tau() const { return tau_; }

  // How many proofs: of safety, and of sight.
  int Asks(const Ellipsoid& e) const { return SightFrom(e) < kNoSight ? 2 : 1; }

 private:
  static constexpr double kSlack = 1e-9;  // m; more than the rounding of a room

  bool IsKept(const world::SeparationResult& result) {
    tau_ = result.kept == world::Kept::kTouches ? result.tau : -1.0;
    return result.kept == world::Kept::kOff;
  }
  double SightFrom(const Ellipsoid& e) const { return std::max(sight_from_, e.sight_from); }
  double SightRadius(const Ellipsoid& e) const { return e.sight_share * problem_.sight_radius; }

  template <class Answer>
  static world::SeparationResult Remembered(SeparationMemory* memory,
                                            const SeparationMemory::Question& question,
                                            Answer answer) {
    if (!memory || question.obstacle < 0) return answer();
    if (const world::SeparationResult* known = memory->Find(question)) return *known;
    const world::SeparationResult result = answer();
    if (result.kept == world::Kept::kOff) memory->Add(question, result);
    return result;
  }

  world::SeparationResult Off(const Ellipsoid& e, SeparationMemory* memory) {
    return Remembered(memory, {e.index, -1.0, e.safety_radius, e.safety_from},
                      [&] { return KeepOff(e); });
  }

  world::SeparationResult InSight(const Ellipsoid& e, SeparationMemory* memory) {
    return Remembered(memory, {e.index, e.sight_share, SightRadius(e), SightFrom(e)},
                      [&] { return KeepInSight(e); });
  }

  world::SeparationResult KeepOff(const Ellipsoid& e) {
    if (drone_.radius[0] != e.safety_radius) {
      drone_.radius[0] = e.safety_radius;
      safety_.TakeRadii();
    }
    if (e.safety_from > 0.0) return world::Separate(drone_, nullptr, *e.body, e.safety_from);
    return safety_.From(*e.body);
  }

  world::SeparationResult KeepInSight(const Ellipsoid& e) {
    if (e.sight_share != share_) {
      share_ = e.sight_share;
      eye_.radius[0] = SightRadius(e);
      target_.radius = TargetRadius(problem_, e.sight_share);
      sight_.TakeRadii();
    }
    if (SightFrom(e) > 0.0) return world::Separate(eye_, &target_, *e.body, SightFrom(e));
    return sight_.From(*e.body);
  }

  static void Add(int obstacle, double from, double radius, double room,
                  world::Certificate separations, std::vector<Proof>* proofs) {
    Proof& proof = proofs->emplace_back();
    proof.obstacle = obstacle;
    proof.from = from;
    proof.radius = radius;
    proof.separations = std::move(separations);
    proof.room = room;
  }

  const Problem& problem_;
  double sight_from_;
  world::Ball drone_, eye_, target_;  ///< the last two: ends of the line of sight
  std::optional<double> share_;       ///< of the margins of sight that their radii are
  world::Separator safety_, sight_;
  double tau_ = -1.0;
  double least_ = HUGE_VAL;  ///< distance to the obstacles of the proofs so far, m
};

// Whether the plan, or its line of sight, touches there what the last one did.
bool IsTouched(const Curve& plan, const Problem& problem, double sight_from, const Refusal& last) {
  const Ellipsoid& e = problem.obstacles[static_cast<size_t>(last.obstacle)];
  if (!e.body || last.tau < e.safety_from) return false;
  const double from = std::max(sight_from, e.sight_from);
  if (from >= kNoSight || last.tau < from)
    return world::Touch(DroneBall(plan, e.safety_radius), nullptr, *e.body, last.tau);
  const world::Ball target = TargetBall(problem, e.sight_share);
  return world::Touch(DroneBall(plan, e.sight_share * problem.sight_radius), &target, *e.body,
                      last.tau);
}

}  // namespace

void SeparationMemory::About(const Curve& curve, const Problem& problem) {
  if (curve.rows() == curve_.rows() && curve == curve_ && t0_ == problem.t0 &&
      duration_ == problem.duration)
    return;
  curve_ = curve;
  t0_ = problem.t0;
  duration_ = problem.duration;
  answers_.clear();
}

const world::SeparationResult* SeparationMemory::Find(const Question& question) const {
  for (const auto& [asked, answer] : answers_)
    if (asked == question) return &answer;
  return nullptr;
}

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

bool StaysOff(const Curve& plan, const Problem& problem, double sight_from, Refusal* last,
              SeparationMemory* memory) {
  const int n = static_cast<int>(problem.obstacles.size());
  const bool known = last && last->obstacle >= 0 && last->obstacle < n;
  if (known && IsTouched(plan, problem, sight_from, *last)) return false;
  Prover prover(plan, problem, sight_from);
  const Sieve sieve(plan, problem, sight_from);
  if (memory) memory->About(plan, problem);
  const auto is_off = [&](const Ellipsoid& e) {
    return !sieve.IsNear(e) || prover.IsOff(e, nullptr, memory);
  };
  const auto is_off_at = [&](int j) {
    const bool off = is_off(problem.obstacles[static_cast<size_t>(j)]);
    if (!off && last) *last = {j, prover.tau()};
    return off;
  };
  if (known && !is_off_at(last->obstacle)) return false;
  if (problem.target_body && !is_off(*problem.target_body)) return false;
  if (problem.reach && Contains(*problem.reach, plan))
    return std::all_of(problem.near.begin(), problem.near.end(), is_off_at);
  for (int j = 0; j < n; ++j)
    if (!is_off_at(j)) return false;
  return true;
}

// Where a plan fails it fails at what is near: that is asked first.
std::optional<std::vector<Proof>> ProveOff(const Curve& plan, const Problem& problem,
                                           double sight_from, SeparationMemory* memory,
                                           Refusal* at) {
  Prover prover(plan, problem, sight_from);
  const Sieve sieve(plan, problem, sight_from);
  if (memory) memory->About(plan, problem);
  const size_t n = problem.obstacles.size();
  std::vector<Proof> near, proofs;
  std::vector<char> is_near(n);
  for (size_t j = 0; j < n; ++j) {
    is_near[j] = sieve.IsNear(problem.obstacles[j]);
    if (!is_near[j] || prover.IsOff(problem.obstacles[j], &near, memory)) continue;
    if (at) *at = {static_cast<int>(j), prover.tau()};
    return std::nullopt;
  }
  proofs.reserve(2 * n + 1);
  auto next = near.begin();
  for (size_t j = 0; j < n; ++j) {
    const Ellipsoid& e = problem.obstacles[j];
    if (is_near[j]) {
      for (int i = prover.Asks(e); i > 0; --i) proofs.push_back(std::move(*next++));
    } else if (e.body && !prover.IsOff(e, &proofs, nullptr)) {
      return std::nullopt;
    }
  }
  if (problem.target_body && !prover.IsOff(*problem.target_body, &proofs, nullptr))
    return std::nullopt;
  return proofs;
}

}  // namespace chase::planning
