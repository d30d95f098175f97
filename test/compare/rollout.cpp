#include "test/compare/rollout.h"

#include <chrono>
#include <cmath>
#include <ctime>

namespace chase::compare {
namespace {

constexpr double kSampling = 0.01;  // s

double ThreadMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

planning::PlanRequest Request(const Mission& mission, double t, const world::State& state,
                              const baselines::Pieces& running) {
  planning::PlanRequest request;
  request.t0 = t;
  request.horizon = mission.planning.horizon;
  request.start = state;
  request.target = FitTarget(mission, t, request.horizon);
  request.obstacles = mission.obstacles;
  if (running.empty()) return request;
  request.running = running.front();
  request.running_rest.assign(running.begin() + 1, running.end());
  return request;
}

planning::PlanResult Ask(const planning::PlanRequest& request, planning::Planner* planner,
                         Replan* replan) {
  using Clock = std::chrono::steady_clock;
  const double cpu = ThreadMilliseconds();
  const auto before = Clock::now();
  planning::PlanResult plan = planner->Plan(request);
  replan->wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - before).count();
  replan->cpu_ms = ThreadMilliseconds() - cpu;
  replan->t = request.t0;
  replan->verdict = plan.verdict;
  replan->reason = plan.reason;
  return plan;
}

}  // namespace

Rollout Fly(const Mission& mission, planning::Planner* planner) {
  Rollout rollout;
  world::State state = StartState(mission);
  baselines::Pieces running;
  const long per_plan = std::lround(mission.planning.replan_period / kSampling);
  const long n = std::lround(mission.duration / kSampling);
  for (long first = 0; first < n; first += per_plan) {
    Replan replan;
    const double t = kSampling * static_cast<double>(first);
    running = baselines::PiecesOf(Ask(Request(mission, t, state, running), planner, &replan));
    for (long i = first + 1; i <= std::min(n, first + per_plan); ++i) {
      const double now = kSampling * static_cast<double>(i);
      state = baselines::StateAt(running, now);
      rollout.samples.push_back({now, state, mission.Target(now), mission.TargetVelocity(now)});
    }
    replan.flown = running;
    rollout.replans.push_back(std::move(replan));
  }
  return rollout;
}

}  // namespace chase::compare
