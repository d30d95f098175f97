#include "test/unit/planning_minkowski.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

// Whole plans, with margins, tube and uncertainty.

namespace chase::planning {
namespace {

using namespace minkowski;

/// What a plan that is called certified promises, one sentence per broken promise. Counts movers
/// that are about where its stop begins late.
std::vector<std::string> BrokenPromises(const PlannerConfig& c, const PlanRequest& request,
                                        const PlanResult& plan, int* n_late) {
  std::vector<std::string> broken;
  std::set<int> safe;
  const auto check = [&](const char* what, double gap, int id) {
    if (gap < -kTolerance) broken.push_back(std::string(what) + std::to_string(id));
  };
  const double hard = HardRadius(c, request);
  const double soft = std::max(hard, c.hard_radius() + c.safety_margin);  // a wider tube takes it
  const double left = plan.stop ? plan.stop->start : plan.trajectory.end();
  for (const Proof& p : plan.proofs) {
    const world::Trajectory& way = plan.trajectory;
    if (p.obstacle == kTargetId) {
      if (p.from == 0.0)
        check("the target ", LeastGapFromTarget(request, way, p.radius, left, c.sigmas),
              p.obstacle);
      continue;
    }
    const world::Obstacle& o = request.obstacles[static_cast<size_t>(p.obstacle)];
    const auto gap = [&](double radius, const world::Ball* target = nullptr) {
      return LeastGap(way, radius, p.from, target, o, c.sigmas,
                      plan.stop ? world::kOverdue : HUGE_VAL);
    };
    if (p.of_sight) {
      const world::Ball target{request.target.Reparametrised(way.start, way.duration).coefficients,
                               p.target_radius};
      check("sight of ", gap(p.radius, &target), o.id);
      for (const double tau : {0.0, 0.5, 1.0})  // its own uncertainty, from the request
        if (const double t = way.start + tau * way.duration; plan.reason.empty())
          check("uncertainty in sight of ",
                math::Evaluate(p.target_radius, tau) - c.sight_margin -
                    c.sigmas * TargetSigma(request, t),
                o.id);
      continue;
    }
    safe.insert(o.id);
    check("safety from ", gap(p.radius), o.id);
    const auto until = way.Reparametrised(way.start, std::max(1e-3, left - way.start));
    *n_late += o.moving && left > way.start + world::kOverdue + 1e-9;
    if (p.from == 0.0) {
      check("clearance from ", gap(hard + plan.certified_clearance), o.id);
      check("until it stops from ", LeastGap(until, hard, 0.0, nullptr, o, c.sigmas), o.id);
    }
    if (p.from > 0.0 && plan.verdict != Verdict::kEscape) broken.push_back("late, and no escape");
    if (p.radius < hard) broken.push_back("less than the hard radius");
    if (plan.reason.empty() && p.radius < soft - 1e-12)
      broken.push_back("less than the margin, unsaid");
  }
  if (safe.size() != request.obstacles.size()) broken.push_back("an obstacle without a proof");
  if (plan.verdict == Verdict::kChase && plan.reason.empty()) {
    size_t sights = 0;
    for (const Proof& p : plan.proofs) sights += p.of_sight && p.from == 0.0;
    if (sights != request.obstacles.size()) broken.push_back("sight without a proof");
  }
  if (plan.verdict == Verdict::kChase && plan.trajectory.duration < request.horizon)
    broken.push_back("a chase over a part of the horizon");
  if (plan.verdict <= Verdict::kSafeOnly && plan.trajectory.duration > request.horizon + 1e-9)
    broken.push_back("beyond the horizon");
  const bool chases = plan.verdict <= Verdict::kSafeOnly;
  for (const world::Obstacle& o : request.unseen) {
    // From within they lead out.
    const double start =
        LeastGap({plan.trajectory.coefficients.row(0), math::Polynomial::Constant(1, hard)},
                 nullptr, Truth(o, plan.trajectory.start, 1.0, c.sigmas), 1.0);
    if (!chases || !plan.stop || start < 0.01) continue;
    const world::Trajectory until =
        plan.trajectory.Reparametrised(plan.trajectory.start, left - plan.trajectory.start);
    check("into the unseen ", LeastGap(until, hard, 0.0, nullptr, o, c.sigmas), o.id);
    check("stop in the unseen ", LeastGap(*plan.stop, hard, 0.0, nullptr, o, c.sigmas), o.id);
  }
  if (plan.stop)
    for (const Proof& p : plan.stop_proofs) {
      if (p.obstacle == kTargetId) {
        if (p.from == 0.0)
          check("stop from the target ",
                LeastGapFromTarget(request, *plan.stop, hard, plan.stop->end(), c.sigmas),
                p.obstacle);
        continue;
      }
      const world::Obstacle& o = request.obstacles[static_cast<size_t>(p.obstacle)];
      check("stop from ", LeastGap(*plan.stop, hard, p.from, nullptr, o, c.sigmas), o.id);
      if (p.from > 0.0 && plan.verdict != Verdict::kEscape)
        broken.push_back("late stop, no escape");
    }
  else if (plan.verdict != Verdict::kBrake &&
           plan.trajectory.Velocity(plan.trajectory.end()).norm() > 1e-6)
    broken.push_back("no stop");
  return broken;
}

/// The request of a planner whose plan is flown, so much later.
void GoOn(double later, const PlanResult& plan, PlanRequest* request) {
  const world::Trajectory& flown = plan.trajectory;
  request->t0 += later;
  request->horizon -= later;
  request->start = flown.At(std::min(request->t0, flown.end()));
  request->yaw = YawAt(plan.yaw, std::min(1.0, later / flown.duration), flown.duration);
  request->running = flown;
}

TEST(Minkowski, CertifiedPlansKeepOffWhatTheySayTheyDo) {
  const char* count = std::getenv("CHASE_PLANS");
  const unsigned n = count ? static_cast<unsigned>(std::atoi(count)) : 200;
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  int certified = 0, in_sight = 0, false_accepts = 0, n_late = 0;
  std::map<Verdict, int> verdicts;
  for (unsigned seed = 1; seed <= n; ++seed) {
    PlanRequest request = RandomRequest(config, seed);
    if (seed % 2 == 0) Surround(seed, &request);
    // Each plan, and the one that follows it.
    for (const double later : {0.0, 0.3}) {
      if (later > 0.0) GoOn(later, planner->Plan(request), &request);
      const PlanResult plan = planner->Plan(request);
      ++verdicts[plan.verdict];
      if (plan.certified_clearance < 0.0) continue;
      ++certified;
      in_sight += plan.verdict == Verdict::kChase;
      const std::vector<std::string> broken = BrokenPromises(config, request, plan, &n_late);
      false_accepts += !broken.empty();
      for (const std::string& what : broken)
        ADD_FAILURE() << "seed " << seed << " " << later << " " << Name(plan.verdict) << ": "
                      << what;
    }
  }
  for (const auto& [verdict, k] : verdicts) std::printf("%s %d\n", Name(verdict), k);
  std::printf("%u plans, %d certified, %d false\n", 2 * n, certified, false_accepts);
  EXPECT_GT(certified, static_cast<int>(n));
  EXPECT_GT(in_sight, static_cast<int>(n) / 5);
  EXPECT_GT(n_late, static_cast<int>(n) / 20);
}

}  // namespace
}  // namespace chase::planning
