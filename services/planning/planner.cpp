#include "services/planning/planner.h"

#include <stdexcept>

#include "services/planning/fast_search.h"
#include "services/planning/ladder.h"
#include "services/planning/reference_search.h"

namespace chase::planning {

const char* Name(Verdict verdict) {
  constexpr const char* kNames[] = {"CHASE", "WIDER", "KEPT", "SAFE_ONLY", "BRAKE", "WAIT"};
  return kNames[static_cast<int>(verdict)];
}

namespace {

// Two plans of a walk past a pillar, so that the first that matters finds tables and memory ready.
void WarmUp(const PlannerConfig& config, Planner* planner) {
  PlanRequest request;
  request.start.p = {-config.desired_distance, 0.0, 1.5};
  request.target.coefficients = Eigen::MatrixXd::Zero(2, 3);
  request.target.coefficients.row(0) << 0.0, 0.0, 1.0;
  request.target.coefficients.row(1) << request.horizon, 0.0, 0.0;
  request.target.duration = request.horizon;
  world::Obstacle pillar;
  pillar.center = world::Trajectory::Constant({0.0, 1.5, 1.0}, 0.0, request.horizon);
  request.obstacles = {pillar};
  const PlanResult first = planner->Plan(request);
  request.t0 = 0.2;
  request.start = first.trajectory.At(request.t0);
  request.running = first.trajectory;
  planner->Plan(request);
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
