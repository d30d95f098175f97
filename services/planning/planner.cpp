#include "services/planning/planner.h"

#include <stdexcept>

#include "services/planning/fast_search.h"
#include "services/planning/ladder.h"
#include "services/planning/reference_search.h"

namespace chase::planning {

const char* Name(Verdict verdict) {
  constexpr const char* kNames[] = {"CHASE", "WIDER", "KEPT",   "SAFE_ONLY",
                                    "BRAKE", "WAIT",  "ESCAPE", "MITIGATE"};
  return kNames[static_cast<int>(verdict)];
}

namespace {

// A walk between pillars, so that the first plan that matters finds tables and memory ready.
void WarmUp(const PlannerConfig& config, Planner* planner) {
  for (const double horizon : {2.5, 5.0}) {
    PlanRequest request;
    request.horizon = horizon;
    request.start.p = {-config.desired_distance, 0.0, 1.5};
    request.target.duration = horizon;
    request.target.coefficients = Eigen::MatrixXd::Zero(2, 3);
    request.target.coefficients.row(1) << horizon, 0.0, 0.0;
    for (int i = 0; i < 24; ++i) {
      const double side = i % 2 ? 1.3 : -1.3, along = 0.7 * i - 4.0;
      world::Obstacle pillar;
      pillar.id = i;
      pillar.center = world::Trajectory::Constant({along, side * (1 + i % 3), 1.0}, 0.0, horizon);
      pillar.shape = Eigen::Vector3d(4.0, 4.0, 0.1).asDiagonal();
      request.obstacles.push_back(pillar);
    }
    for (int i = 0; i < 6; ++i) {
      request.target.start = request.t0;
      request.target.coefficients.row(0) << request.t0, 0.2 * (i % 3), 1.0;
      const PlanResult plan = planner->Plan(request);
      request.t0 += 0.3;
      request.start = plan.trajectory.At(request.t0);
      request.running = plan.trajectory;
    }
  }
}

}  // namespace

std::vector<std::string> PlannerNames() { return {"chase", "reference", "reference-double"}; }

std::unique_ptr<Planner> MakePlanner(const std::string& name, const PlannerConfig& config) {
  if (name == "chase") {
    auto planner = MakeLadder(config, MakeFastSearch(config));
    WarmUp(config, planner.get());
    return planner;
  }
  if (name == "reference")
    return MakeLadder(config, MakeReferenceSearch(config, Arithmetic::kExactSturm));
  if (name == "reference-double")
    return MakeLadder(config, MakeReferenceSearch(config, Arithmetic::kDoubleSturm));
  std::string known;
  for (const std::string& n : PlannerNames()) known += (known.empty() ? "" : ", ") + n;
  throw std::invalid_argument("planner '" + name + "' is not known; choose one of " + known);
}

}  // namespace chase::planning
