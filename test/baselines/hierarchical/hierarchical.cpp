// Jeon, Lee, Kim, "Integrated motion planner for real-time aerial videography with a drone in a
// dense environment", ICRA 2020, reconstructed: a graph of views searched for way-points, then a
// corridor along them, then a quadratic program. See README.md.

#include "test/baselines/hierarchical/corridor.h"
#include "test/baselines/hierarchical/view_graph.h"
#include "test/baselines/registry.h"
#include "test/baselines/rival.h"

namespace chase::baselines {
namespace {

class Hierarchical : public Rival {
 public:
  explicit Hierarchical(const planning::PlannerConfig& config) : Rival(config) {
    parameters_.desired_distance = config.desired_distance;
    parameters_.min_distance = 0.5 * config.desired_distance;
    parameters_.max_distance = 1.5 * config.desired_distance;
  }

  planning::PlanResult Plan(const planning::PlanRequest& request) override {
    if (!IsSound(request)) return KeepOrBrake(config_, request, "the request is not finite");
    if (!field_.IsOf(request.obstacles))
      field_ = DistanceField(request.obstacles, parameters_.field_cell, parameters_.field_cut);
    HierarchicalParameters p = parameters_;
    std::string why;
    for (int attempt = 0; attempt < 4; ++attempt) {
      if (attempt == 1) p.safe = p.safe_retry;
      if (attempt == 2) p.connect *= p.retry_factor;
      if (attempt == 3) p.corridor *= p.retry_factor;
      if (const auto plan = Try(p, request, &why)) return Answer(config_, request, *plan);
    }
    return KeepOrBrake(config_, request, why);
  }

 private:
  std::optional<Pieces> Try(const HierarchicalParameters& p, const planning::PlanRequest& request,
                            std::string* why) const {
    const double layer_time = request.horizon / p.layers;
    std::vector<Eigen::Vector3d> targets;
    for (int n = 1; n <= p.layers; ++n)
      targets.push_back(request.target.Position(request.t0 + n * layer_time));
    const auto views = CheapestViews(p, field_, request.start.p, targets, layer_time);
    if (views.empty()) return *why = "no way through the views", std::nullopt;
    auto plan = SmoothCorridor(p, request.start, views, request.t0, request.horizon);
    if (!plan) *why = "no smooth path in the corridor";
    return plan;
  }

  HierarchicalParameters parameters_;
  DistanceField field_;
};

const Registration kHierarchical(
    "hierarchical", [](const Setup& s) { return std::make_unique<Hierarchical>(s.config); }, true);

}  // namespace
}  // namespace chase::baselines
