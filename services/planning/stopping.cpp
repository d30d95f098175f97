#include "services/planning/stopping.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "services/planning/candidate_set.h"
#include "services/planning/resting.h"
#include "services/planning/separations.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr double kLeast = 0.1;  // s of a way to rest that are worth to be flown

PlannerConfig WithoutMargin(PlannerConfig config) {
  config.safety_margin = 0.0;
  return config;
}

// Until t, of a plan: how its part keeps off `obstacles`.
PlanRequest Part(const PlanRequest& request, const world::Trajectory& plan, double t,
                 std::vector<world::Obstacle> obstacles) {
  PlanRequest part;
  static_cast<Stretch&>(part) = {plan.start, t - plan.start, plan.At(plan.start), false};
  part.tube = request.tube;
  part.target = request.target;
  part.obstacles = std::move(obstacles);
  return part;
}

bool KeepsOffUnseen(const PlannerConfig& config, const PlanRequest& request,
                    const world::Trajectory& plan, double t) {
  if (request.unseen.empty() || t <= plan.start) return true;
  const PlanRequest part = Part(request, plan, t, request.unseen);
  return StaysOff(ToCurve(plan, part.t0, part.horizon), MakeProblem(config, part, nullptr),
                  kNoSight);
}

// The proofs of a plan count on its being left after kOverdue: until a later t, does it keep off
// what moves, the target's body too? `leaves`: from within some it may lead out.
bool KeepsOffUntil(const PlannerConfig& config, const PlanRequest& request,
                   const world::Trajectory& plan, double t, bool leaves) {
  if (t <= plan.start + kOverdue) return true;
  std::vector<world::Obstacle> counted;  // the ground, as its slope is the target's
  for (const world::Obstacle& o : request.obstacles)
    if (o.moving || o.ground) counted.push_back(o);
  PlanRequest part = Part(request, plan, t, std::move(counted));
  part.target_body = request.target_body;
  part.target_manoeuvre = request.target_manoeuvre;
  Problem problem = MakeProblem(config, part, nullptr);
  if (!leaves)
    for (Ellipsoid& e : problem.obstacles) e.safety_from = 0.0;
  return StaysOff(ToCurve(plan, part.t0, part.horizon), problem, kNoSight);
}

}  // namespace

std::optional<Stop> Brake(const PlannerConfig& config, const PlanRequest& request) {
  return Resting(config, request).Brake();
}

std::optional<Stop> GoTo(const PlannerConfig& config, const PlanRequest& request,
                         const Vector3d& end) {
  // Rest to rest the speed peaks at 1.9 times the mean, which stays below 4 m/s of max_speed, and
  // the acceleration of the shortest way at 4 m/s^2.
  constexpr double kPace = 1.0, kShortest = 1.5;  // m/s, s
  const double quickest = std::max(kShortest, (end - request.start.p).norm() / kPace);
  Resting resting(config, request);
  for (const double slower : {1.0, 1.5, 2.2}) {
    const double T = slower * quickest;
    if (auto stop = resting.Certified(CurveTo(request.start, T, end), T)) return stop;
  }
  return std::nullopt;
}

std::optional<Stop> GoOn(const PlannerConfig& config, const PlanRequest& request,
                         const world::Trajectory& way) {
  const double T = way.end() - request.t0;
  if (T < kLeast || request.t0 < way.start) return std::nullopt;
  Resting resting(config, request);
  return resting.Certified(ToCurve(way, request.t0, T), T);
}

bool KeepsOffMovers(const PlannerConfig& config, const PlanRequest& request,
                    const world::Trajectory& way) {
  PlanRequest moving = request;
  moving.horizon = std::min(request.horizon, way.end() - request.t0);
  moving.asks_sight = false;
  moving.obstacles.clear();
  for (const world::Obstacle& o : request.obstacles)
    if (o.moving) moving.obstacles.push_back(o);
  return !(moving.horizon > 0.0) ||
         StaysOff(ToCurve(way, moving.t0, moving.horizon),
                  MakeProblem(WithoutMargin(config), moving, nullptr), kNoSight);
}

namespace {

// A BRAKE only slows down. Whose acceleration must first be taken back, or who steps aside, is
// faster for a moment.
void NameFaster(bool certified, PlanResult* plan) {
  constexpr double kFaster = 0.05;  // m/s
  constexpr int kSamples = 50;
  const double limit = plan->trajectory.Velocity(plan->trajectory.start).norm() + kFaster;
  const auto gets_faster = [limit](const world::Trajectory& way) {
    for (int i = 1; i <= kSamples; ++i)
      if (way.Velocity(way.start + i * way.duration / kSamples).norm() > limit) return true;
    return false;
  };
  if (plan->verdict != Verdict::kBrake ||
      !(gets_faster(plan->trajectory) || (plan->stop && gets_faster(*plan->stop))))
    return;
  plan->verdict = certified ? Verdict::kEscape : Verdict::kMitigate;
  plan->reason += plan->reason.empty() ? "to rest, faster at first" : "; faster at first";
}

// The rest of a way to rest, not certified.
std::optional<PlanResult> RestOfStop(const PlanRequest& request, const world::Trajectory& way) {
  const double T = way.end() - request.t0;
  if (T < kLeast) return std::nullopt;
  PlanResult result;
  result.reason = "on the stop of the plan before";
  result.trajectory = {request.t0, T, ToCurve(way, request.t0, T)};
  return result;
}

// What is left of the running plan until its stop, and that stop; not certified.
std::optional<PlanResult> RestOfPlan(const PlanRequest& request) {
  if (!request.stop) return std::nullopt;
  const world::Trajectory& stop = *request.stop;
  if (request.t0 >= stop.start) return RestOfStop(request, stop);
  PlanResult result;
  if (!request.running || stop.start > request.running->end()) return std::nullopt;
  const double T = stop.start - request.t0;
  result.reason = "the running plan until its stop";
  result.trajectory = {request.t0, T, ToCurve(*request.running, request.t0, T)};
  result.stop = stop;
  return result;
}

// What was committed to, where it still holds without a margin.
std::optional<PlanResult> Committed(const PlannerConfig& config, const PlanRequest& request) {
  auto result = RestOfPlan(request);
  if (!result) return std::nullopt;
  const world::Trajectory& way = result->trajectory;
  Resting resting(config, request);
  auto rest = resting.Certified(Curve(way.coefficients), way.duration);
  if (!rest) return std::nullopt;
  bool leaves = LeavesObstacles(rest->proofs);
  if (result->stop) {
    const world::Trajectory& after = *result->stop;
    resting.From(request.running->At(after.start), after.start);
    auto stop = resting.Certified(Curve(after.coefficients), after.duration);
    if (!stop) return std::nullopt;
    leaves = leaves || LeavesObstacles(stop->proofs);
    result->stop_proofs = std::move(stop->proofs);
    result->verdict = Verdict::kSafeOnly;
  }
  if (leaves) result->verdict = Verdict::kEscape;
  SetProofs(config, request, std::move(rest->proofs), &*result);
  return result;
}

// Static obstacles without the drift of the frame: over kLasts it would cover any place of rest,
// and the next plan gets a new list.
PlanRequest WithoutDrift(PlanRequest request) {
  for (world::Obstacle& o : request.obstacles)
    if (!o.moving) o.velocity_covariance.setZero();
  return request;
}

}  // namespace

std::optional<PlanResult> AsCommitted(const PlanRequest& request) {
  const auto& running = request.running;  // without a stop it is on its way to rest already
  auto result = request.stop                             ? RestOfPlan(request)
                : running && world::EndsAtRest(*running) ? RestOfStop(request, *running)
                                                         : std::nullopt;
  if (result) NameFaster(false, &*result);
  return result;
}

PlanResult AsLastResort(const std::string& why, PlanResult plan) {
  plan.proofs.clear();
  plan.stop_proofs.clear();
  plan.certified_clearance = -1.0;
  if (plan.verdict == Verdict::kEscape) plan.verdict = Verdict::kMitigate;
  if (plan.verdict < Verdict::kBrake) plan.verdict = Verdict::kBrake;
  plan.reason = why + (plan.reason.empty() ? "" : "; " + plan.reason);
  return plan;
}

constexpr double kOver[] = {0.7, 1.0, 1.6};  // s, that ways aside take
// s from now on that a place of rest should be clear: there is a way aside until then.
constexpr double kLasts = kOver[2] + kOverdue;

// Rings of directions, level, up and down; the last leads from the ground to above its slab.
std::vector<Vector3d> PlacesAside() {
  constexpr int kAround = 12;
  std::vector<Vector3d> all;
  for (const double r : {0.4, 0.8, 1.4, 2.2})
    for (const double rise : {0.0, 0.5, -0.5})
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2.0 * M_PI * i / kAround;
        all.emplace_back(r * std::cos(angle), r * std::sin(angle), rise * r);
      }
  for (const double rise : {0.5, -0.5, 1.0, -1.0, 1.5}) all.emplace_back(0.0, 0.0, rise);
  std::stable_sort(all.begin(), all.end(), [](const Vector3d& a, const Vector3d& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  return all;
}

Stop Evade(const PlannerConfig& config, const PlanRequest& request) {
  static const std::vector<Vector3d> places = PlacesAside();
  const std::vector<world::Obstacle>& unseen = request.unseen;
  Resting resting[] = {{config, request}, {config, request}, {config, request}};
  Resting seen[] = {
      {config, request, unseen}, {config, request, unseen}, {config, request, unseen}};
  const PlanRequest without_drift = WithoutDrift(request);
  Resting after(config, without_drift);
  // Certified, but nobody has looked into it, or somebody comes there soon.
  std::optional<Stop> blind, brief;
  Stop best;
  std::pair<double, double> least{-HUGE_VAL, -HUGE_VAL};
  const auto weigh = [&](Resting* way, const Curve& curve, double T, bool aside) {
    if (!curve.allFinite()) return;
    const std::pair<double, double> harm = way->Harm(curve, T);
    if (harm <= least) return;
    least = harm;
    best.trajectory = {request.t0, T, curve};
    best.aside = aside;
  };
  constexpr double kLongest = kBrakeTimes[4];
  Resting braking(config, request);
  for (const double T : {kBrakeTimes[0], kBrakeTimes[2], kLongest}) {
    const Curve curve = BrakeCurve(request.start, T);
    if (braking.CanBeFlown(curve, T)) weigh(&braking, curve, T, false);
  }
  for (const Vector3d& d : places)
    for (int i = 0; i < 3; ++i) {
      const double T = kOver[i];
      const Vector3d end = ToPoints(BrakeCurve(request.start, T), 5).row(5).transpose() + d;
      const Curve curve = CurveTo(request.start, T, end);
      if (auto stop = resting[i].Certified(curve, T)) {
        stop->blind = !unseen.empty() && !seen[i].Certified(curve, T);
        stop->lasts = after.Lasts(*stop, request.t0 + kLasts);
        if (!stop->blind && stop->lasts) return *stop;
        std::optional<Stop>& second = stop->blind ? blind : brief;
        if (!second || (stop->lasts && !second->lasts)) second = std::move(stop);
        continue;
      }
      if (!blind && !brief && resting[i].CanBeFlown(curve, T)) weigh(&resting[i], curve, T, true);
    }
  if (brief) return *brief;
  if (blind) return *blind;
  if (least.first < 0.0)  // none can be flown
    weigh(&braking, BrakeCurve(request.start, kLongest), kLongest, false);
  if (least.first < 0.0)  // none is finite
    best.trajectory = world::Trajectory::Constant(request.start.p, request.t0, 1.0);
  return best;
}

void SetProofs(const PlannerConfig& config, const PlanRequest& request, std::vector<Proof> proofs,
               PlanResult* result) {
  const Ground ground = GroundOf(request.obstacles);
  const Points points = ToPoints(Curve(result->trajectory.coefficients), 6);
  double least = LeastKept(proofs);
  for (int i = 0; i <= 6; ++i) least = std::min(least, ground.Above(points.row(i).transpose()));
  result->certified_clearance = std::max(0.0, least - HardRadius(config, request));
  result->proofs = std::move(proofs);
}

double LeastKept(const std::vector<Proof>& proofs) {
  double least = HUGE_VAL;
  for (const Proof& p : proofs)
    if (!p.of_sight) least = std::min(least, p.from > 0.0 ? 0.0 : p.radius + p.room);
  return least;
}

bool LeavesObstacles(const std::vector<Proof>& proofs) {
  return std::any_of(proofs.begin(), proofs.end(), [](const Proof& p) { return p.from > 0.0; });
}

namespace {

std::string IntoTheUnseen(const Stop& stop) {
  return stop.blind ? ", aside into what nobody has looked into" : "";
}

}  // namespace

PlanResult RestPlan(const PlannerConfig& config, const PlanRequest& request) {
  const PlannerConfig hard = WithoutMargin(config);
  PlanResult result;
  Resting wide(config, request), close(hard, request);
  std::optional<Stop> stop = wide.BrakeWithin();
  if (!stop) stop = close.BrakeWithin();
  // Braking may be, where what was committed to turns back.
  const auto is_blind = [&](const world::Trajectory& way) {
    return !KeepsOffUnseen(hard, request, way, way.end());
  };
  const bool blind = stop && is_blind(stop->trajectory);
  const auto lasts = [&] {
    const PlanRequest without_drift = WithoutDrift(request);
    return Resting(hard, without_drift).Lasts(*stop, request.t0 + kLasts);
  };
  if (stop && !lasts()) {
    Stop aside = Evade(hard, request);
    if (aside.certified && aside.lasts) {
      result.verdict = Verdict::kEscape;
      result.reason = "somebody comes where braking leads" + IntoTheUnseen(aside);
      result.trajectory = std::move(aside.trajectory);
      SetProofs(config, request, std::move(aside.proofs), &result);
      return result;
    }
  }
  if (!stop || blind) {
    auto committed = Committed(hard, request);
    if (committed && (!stop || !(is_blind(committed->trajectory) ||
                                 (committed->stop && is_blind(*committed->stop))))) {
      NameFaster(true, &*committed);
      return *committed;
    }
  }
  if (!stop) stop = wide.Brake();
  if (!stop) stop = close.Brake();
  if (!stop) {
    stop = Evade(hard, request);
    if (stop->certified) result.verdict = Verdict::kEscape;
    if (stop->aside) result.verdict = Verdict::kMitigate;
    result.reason = stop->certified ? "nor is braking" + IntoTheUnseen(*stop)
                                    : "nor is braking, nor any way aside";
  }
  if (LeavesObstacles(stop->proofs)) result.verdict = Verdict::kEscape;
  result.trajectory = std::move(stop->trajectory);
  if (stop->certified) SetProofs(config, request, std::move(stop->proofs), &result);
  NameFaster(stop->certified, &result);
  return result;
}

std::optional<Stop> WayOut(const PlannerConfig& config, const PlanRequest& request,
                           const world::Trajectory& plan, bool leaves, Problem* memory) {
  const PlannerConfig hard = WithoutMargin(config);
  const auto is_unseen = [&](const Proof& proof) {
    return std::any_of(request.unseen.begin(), request.unseen.end(),
                       [&](const auto& o) { return o.id == proof.obstacle; });
  };
  Resting resting(hard, request, request.unseen, memory);
  if (!leaves) resting.KeepOff();
  for (const auto way : {&Resting::RiseOrBrake, &Resting::StepAside})
    for (const double after : {kOverdue, 0.2, 0.7, 1.1, HUGE_VAL}) {
      const double t = std::min(plan.start + after, plan.end());
      resting.From(plan.At(t), t);
      std::optional<Stop> stop;
      if (KeepsOffUnseen(hard, request, plan, t)) stop = (resting.*way)();
      if (stop && KeepsOffUntil(hard, request, plan, t, leaves)) {
        // Whoever checks it hears of obstacles only.
        auto& proofs = stop->proofs;
        proofs.erase(std::remove_if(proofs.begin(), proofs.end(), is_unseen), proofs.end());
        return stop;
      }
      if (t == plan.end()) break;
    }
  return std::nullopt;
}

}  // namespace chase::planning
