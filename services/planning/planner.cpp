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

std::vector<std::string> PlannerNames() { return {"chase", "reference", "reference-double"}; }

std::unique_ptr<Planner> MakePlanner(const std::string& name, const PlannerConfig& config) {
  if (name == "chase") return MakeLadder(config, MakeFastSearch(config));
  if (name == "reference")
    return MakeLadder(config, MakeReferenceSearch(config, Arithmetic::kExactSturm));
  if (name == "reference-double")
    return MakeLadder(config, MakeReferenceSearch(config, Arithmetic::kDoubleSturm));
  std::string known;
  for (const std::string& n : PlannerNames()) known += (known.empty() ? "" : ", ") + n;
  throw std::invalid_argument("planner '" + name + "' is not known; choose one of " + known);
}

}  // namespace chase::planning
