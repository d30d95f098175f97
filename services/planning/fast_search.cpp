#include "services/planning/search.h"

namespace chase::planning {

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config) {
  return MakeReferenceSearch(config, Arithmetic::kCertified);
}

}  // namespace chase::planning
