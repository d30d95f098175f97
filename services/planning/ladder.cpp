#include "services/planning/ladder.h"

#include <algorithm>
#include <cmath>

#include "services/planning/cost.h"
#include "services/planning/field_of_view.h"
#include "services/planning/limits.h"
#include "services/planning/margins.h"
#include "services/planning/refinement.h"
#include "services/planning/separations.h"
#include "services/planning/skeletons.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

world::Trajectory ToTrajectory(const Curve& curve, double start, double duration) {
  return {start, duration, curve};
}

PlannerConfig WithSmallerMargins(PlannerConfig config) {
  config.safety_margin *= 0.5;
  config.sight_margin *= 0.5;
  return config;
}

Stretch RestOf(const world::Trajectory& plan, const Stretch& over) {
  return {over.t0, plan.end() - over.t0, plan.At(over.t0), over.asks_sight};
}

class Ladder : public Planner {
 public:
  Ladder(const PlannerConfig& config, std::unique_ptr<Search> search)
      : config_(config),
        tight_(WithSmallerMargins(config)),
        search_(std::move(search)),
        placer_(config),
        shelf_(config),
        refiner_(config) {
    proof_.Remember(&separations_);
    refiner_.Remember(&separations_);
  }

  PlanResult Plan(const PlanRequest& request) override {
    std::string notes;
    separations_.Clear();
    MakeProblem(config_, request, request, &notes, &problem_);
    used_ = &problem_;
    sight_from_ = 0.0;
    PlanResult result;
    const auto finish = [&] { return Certify(request, &result); };
    if (!(TryChase(request, &notes, &result) && finish()) &&
        !(TryKeep(request, &result) && finish()) &&
        !(TrySafeOnly(request, 1.0, &result) && finish()))
      RestOrBrief(request, &result);
    if (!notes.empty()) {
      if (IsInSightVerdict(result.verdict) && WeakensSight(*used_))
        result.verdict = Verdict::kSafeOnly;
      if (result.verdict < Verdict::kBrake && StartsInside(*used_))
        result.verdict = Verdict::kEscape;
      Note(&result.reason, notes);
    }
    result.yaw = FitYaw(result.trajectory, request.target, request.yaw, config_.max_yaw_rate);
    SetField(request, &result);
    return result;
  }

  bool IsCertified(const PlanRequest& request, const world::Trajectory& plan) override {
    const Stretch rest = RestOf(plan, request);
    if (!(rest.horizon > 0.05)) return false;
    MakeProblem(tight_, request, rest, nullptr, &shorter_);
    const Curve curve = ToCurve(plan, rest.t0, rest.horizon);
    separations_.Clear();
    proof_.Reset(shorter_, 0.0, config_.exact_visibility);
    return proof_.Holds(curve) && KeepsLimits(curve, shorter_);
  }

 private:
  static bool IsInSightVerdict(Verdict v) {
    return v == Verdict::kChase || v == Verdict::kWider || v == Verdict::kKept;
  }
  // The proofs of a plan for whoever flies it, and its way out; false where it has none.
  bool Certify(const PlanRequest& request, PlanResult* result) {
    const auto& obstacles = used_->obstacles;
    const bool asked =
        used_->target_body || std::any_of(obstacles.begin(), obstacles.end(),
                                          [](const auto& e) { return e.body.has_value(); });
    if (!asked && !obstacles.empty()) return true;
    auto proofs =
        ProveOff(Curve(result->trajectory.coefficients), *used_, sight_from_, &separations_);
    if (!proofs) return false;
    auto stop = WayOut(config_, request, result->trajectory, StartsInside(*used_), &stopping_);
    if (!stop) return false;
    SetProofs(config_, request, std::move(*proofs), result);
    result->stop = std::move(stop->trajectory);
    result->stop_proofs = std::move(stop->proofs);
    return true;
  }

  static bool StartsInside(const Problem& problem) {
    const auto inside = [](const Ellipsoid& e) { return e.safety_from > 0.0; };
    return (problem.target_body && inside(*problem.target_body)) ||
           std::any_of(problem.obstacles.begin(), problem.obstacles.end(), inside);
  }
  static bool WeakensSight(const Problem& problem) {
    return std::any_of(problem.obstacles.begin(), problem.obstacles.end(),
                       [](const Ellipsoid& e) { return e.sight_from > 0.0 && !e.ground; });
  }

  // The search takes the yaw for pointing at the target, and a start as it is; the yaw that is
  // flown may still have to catch up.
  void SetField(const PlanRequest& request, PlanResult* result) const {
    const world::Trajectory& plan = result->trajectory;
    const std::optional<View> view = config_.view();
    result->in_field = !view || KeepsView(Curve(plan.coefficients),
                                          ToCurve(request.target, plan.start, plan.duration),
                                          plan.duration, &result->yaw, *view);
    if (result->in_field || !IsInSightVerdict(result->verdict)) return;
    result->verdict = Verdict::kSafeOnly;
    Note(&result->reason, "the target leaves the field of view");
  }

  /// A certified plan on its way through a rung.
  struct Choice {
    Curve plan;
    Cost cost;
    int index = -1;  ///< of the candidate; -1: the running plan, or refined
  };

  // The running plan from now on, as a curve over the problem's duration: its polynomial carried on
  // where that is longer.
  std::optional<Curve> Carried(const PlanRequest& request, const Problem& problem) const {
    if (!config_.refine || !request.running || !request.running_rest.empty()) return std::nullopt;
    const Curve running = ToCurve(*request.running, request.t0, problem.duration);
    if (running.rows() > problem.degree + 1) return std::nullopt;
    Points points = ToPoints(running, problem.degree);
    points.topRows<4>() = ToPoints(problem.start, problem.degree).topRows<4>();
    Curve curve = ToPower(points, problem.degree);
    curve.topRows(4) = problem.start;
    if (!curve.allFinite() || (problem.reach && !Contains(*problem.reach, curve)))
      return std::nullopt;
    return curve;
  }

  // The plan has been certified; moves it downhill as far as it stays so.
  void Refine(Choice* choice) {
    if (!refinable_) return;
    constexpr int kSteps = 2;
    Choice better = *choice;
    better.index = -1;
    if (refiner_.Improve(kSteps, &better.plan, &better.cost)) *choice = better;
  }

  // The running plan refined, or as it is, or led around what is in its way; none where all fail.
  std::optional<Choice> Certified(const Problem& problem, const Curve& carried) {
    constexpr int kSteps = 1;  // more follow with the next plan
    Choice choice{carried, {}};
    if (refiner_.Improve(kSteps, &choice.plan, &choice.cost)) return choice;
    if (proof_.Holds(carried, false) && KeepsLimits(carried, problem)) return choice;
    if (refiner_.Repair(&choice.plan, &choice.cost)) return choice;
    return std::nullopt;
  }

  // The cheapest of the running plan, where it holds or can be made to, and the candidates, both
  // refined. A candidate has to be cheaper than that before it is refined itself.
  bool TrySearch(const Problem& problem, double sight_from, const std::optional<Curve>& carried,
                 PlanResult* result) {
    proof_.Reset(problem, sight_from, config_.exact_visibility);
    refinable_ = config_.refine && refiner_.Reset(problem, sight_from);
    std::optional<Choice> best;
    if (carried && refinable_) best = Certified(problem, *carried);
    const double bound = best ? best->cost.total : HUGE_VAL;
    const Found found = search_->Best(problem, sight_from, bound, &proof_);
    result->generated += found.generated;
    result->checked += found.checked;
    result->feasible += found.feasible;
    if (found.index >= 0) {
      Choice choice{found.plan, found.cost, found.index};
      Refine(&choice);
      if (!best || choice.cost.total < best->cost.total) best = choice;
    }
    if (!best) return false;
    result->winner = best->index;
    result->cost = best->cost;
    result->trajectory.coefficients = best->plan;
    return true;
  }

  // Over the whole horizon, then over shorter ones: a plan that sees the target for the next
  // seconds is renewed before it ends, and a shorter polynomial turns more sharply. What the
  // running plan has left comes before what is shorter than that; wide skeletons cost most; half of
  // the margins come last.
  bool TryChase(const PlanRequest& request, std::string* notes, PlanResult* result) {
    struct Try {
      Layout layout;
      double share;
      bool tight;
    };
    constexpr Try kTries[] = {{Layout::kNormal, 1.0, false}, {Layout::kNormal, 0.7, false},
                              {Layout::kNormal, 0.5, false}, {Layout::kNormal, 0.35, false},
                              {Layout::kWide, 1.0, false},   {Layout::kWide, 0.5, false},
                              {Layout::kNormal, 1.0, true},  {Layout::kNormal, 0.7, true}};
    bool carry = true;
    for (const Try& t : kTries) {
      const double rest = request.running ? request.running->end() - request.t0 : 0.0;
      if (carry && t.share < 1.0 && rest > t.share * request.horizon) {
        carry = false;
        if (TryCarry(request, std::min(rest, request.horizon), notes, result)) return true;
      }
      if (!TryOver(request, t.layout, t.share, t.tight, notes, result)) continue;
      const bool plain = t.layout == Layout::kNormal && t.share == 1.0 && !t.tight;
      result->verdict = plain ? Verdict::kChase : Verdict::kWider;
      if (t.layout == Layout::kWide)
        result->reason = "no candidate of the normal skeletons is feasible";
      if (t.tight) result->reason = "with half of the margins";
      if (t.share < 1.0)
        Note(&result->reason, "sight over " + std::to_string(static_cast<int>(100.0 * t.share)) +
                                  " % of the horizon only");
      return true;
    }
    return false;
  }

  // The problem over a shorter horizon, where that is asked for.
  Problem* Over(const PlanRequest& request, double horizon, bool tight, std::string* notes) {
    if (horizon == request.horizon && !tight) return &problem_;
    Stretch part = request;
    part.horizon = horizon;
    MakeProblem(tight ? tight_ : config_, request, part, notes, &shorter_);
    return &shorter_;
  }

  void Take(const PlanRequest& request, const Problem& problem, PlanResult* result) {
    result->trajectory.start = request.t0;
    result->trajectory.duration = problem.duration;
    used_ = &problem;
  }

  bool TryOver(const PlanRequest& request, Layout layout, double share, bool tight,
               std::string* notes, PlanResult* result) {
    std::string their_notes;
    Problem* problem = Over(request, share * request.horizon, tight, &their_notes);
    placer_.Place(layout, problem);
    LimitToReach(
        config_,
        shelf_.Get(problem->degree, static_cast<int>(problem->skeletons.size()), problem->duration),
        Refiner::kReach, problem);
    const bool carry = layout == Layout::kNormal;
    if (!TrySearch(*problem, 0.0, carry ? Carried(request, *problem) : std::nullopt, result))
      return false;
    if (problem != &problem_) *notes = their_notes;
    Take(request, *problem, result);
    return true;
  }

  // The rest of the running plan, with all its margins, refined or led around obstacles.
  bool TryCarry(const PlanRequest& request, double horizon, std::string* notes,
                PlanResult* result) {
    std::string their_notes;
    Problem* problem = Over(request, horizon, false, &their_notes);
    problem->reach.reset();
    const std::optional<Curve> carried = Carried(request, *problem);
    if (!carried) return false;
    proof_.Reset(*problem, 0.0, config_.exact_visibility);
    if (!refiner_.Reset(*problem, 0.0)) return false;
    const std::optional<Choice> choice = Certified(*problem, *carried);
    if (!choice) return false;
    result->verdict = Verdict::kKept;
    result->reason = "no candidate is feasible over the horizon, the rest of the running plan is";
    if (!proof_.Holds(*carried, false) || !KeepsLimits(*carried, *problem))
      result->reason += ", led around what is in its way";
    result->winner = -1;
    result->cost = choice->cost;
    result->trajectory.coefficients = choice->plan;
    if (problem != &problem_) *notes = their_notes;
    Take(request, *problem, result);
    return true;
  }

  // The running plan with smaller margins.
  bool TryKeep(const PlanRequest& request, PlanResult* result) {
    if (!request.running || request.running->end() - request.t0 < 0.3 ||
        !IsCertified(request, *request.running))
      return false;
    const Stretch rest = RestOf(*request.running, request);
    const Curve curve = ToCurve(*request.running, rest.t0, rest.horizon);
    result->verdict = Verdict::kKept;
    result->reason =
        "no candidate is feasible, the running plan still is, with half of the margins";
    result->trajectory = ToTrajectory(curve, rest.t0, rest.horizon);
    MakeProblem(config_, request, rest, nullptr, &shorter_);
    result->cost = Evaluate(config_, shorter_, curve);
    MakeProblem(tight_, request, rest, nullptr, &shorter_);
    used_ = &shorter_;
    return true;
  }

  // Sight asked from ever later on, then not at all, over a share of the horizon.
  bool TrySafeOnly(const PlanRequest& request, double share, PlanResult* result) {
    result->verdict = Verdict::kSafeOnly;
    Problem* problem = Over(request, share * request.horizon, false, nullptr);
    problem->limits.tan_elevation = 0.0;
    if (problem->target_body) problem->limits.min_distance = 0.0;
    placer_.Place(Layout::kCautious, problem);
    problem->reach.reset();
    struct Try {
      double sight_from;
      bool view;
    };
    for (const auto& [sight_from, view] :
         {Try{0.25, true}, Try{0.5, true}, Try{0.75, true}, Try{0.25, false}, Try{0.5, false},
          Try{0.75, false}, Try{kNoSight, false}}) {
      problem->limits.view = view ? config_.view() : std::nullopt;
      problem->limits.view_from = sight_from;
      if (!TrySearch(*problem, sight_from, std::nullopt, result)) continue;
      Take(request, *problem, result);
      sight_from_ = sight_from;
      result->reason = sight_from < kNoSight
                           ? "no candidate keeps sight; this one has it from " +
                                 std::to_string(static_cast<int>(100 * sight_from)) +
                                 " % of the horizon on"
                           : "no candidate keeps or regains sight";
      if (share < 1.0) result->reason += ", over half of the horizon";
      return true;
    }
    return false;
  }

  // Braking, or the committed way; before any other, and before harm, what is safe for half of the
  // horizon.
  void RestOrBrief(const PlanRequest& request, PlanResult* result) {
    PlanResult rest = RestPlan(config_, request);
    const bool slows = rest.verdict == Verdict::kBrake || rest.verdict == Verdict::kSafeOnly;
    if ((!slows || rest.certified_clearance < 0.0) && TrySafeOnly(request, 0.5, result) &&
        Certify(request, result))
      return;
    rest.reason = "no candidate is safe" + (rest.reason.empty() ? "" : ", " + rest.reason);
    rest.generated = result->generated;
    rest.checked = result->checked;
    rest.feasible = result->feasible;
    *result = std::move(rest);
    Stretch part = request;
    part.horizon = result->trajectory.duration;
    MakeProblem(config_, request, part, nullptr, &shorter_);
    result->cost = Evaluate(config_, shorter_, Curve(result->trajectory.coefficients));
  }

  PlannerConfig config_, tight_;  ///< tight_: half of the margins
  std::unique_ptr<Search> search_;
  SkeletonPlacer placer_;
  TableShelf shelf_;
  Refiner refiner_;
  PlanProof proof_;
  SeparationMemory separations_;
  Problem problem_, shorter_;  ///< over the whole horizon, over a part of it
  Problem stopping_;
  const Problem* used_ = nullptr;  ///< of the two, the one whose plan is taken
  double sight_from_ = 0.0;        ///< of that plan
  bool refinable_ = false;
};

}  // namespace

std::unique_ptr<Planner> MakeLadder(const PlannerConfig& config, std::unique_ptr<Search> search) {
  return std::make_unique<Ladder>(config, std::move(search));
}

}  // namespace chase::planning
