#include "services/planning/reference_search.h"

namespace chase::planning {

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config) {
  return MakeReferenceSearch(config, Arithmetic::kCertified);
}

}  // namespace chase::planning
