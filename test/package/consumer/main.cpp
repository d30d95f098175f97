// A program of somebody else: predicts the target of one scene and plans the chase of another.
// consumer PREDICTION_SCENE PLANNING_SCENE; exit 0 when there are both.
#include <cstdio>

#include "common/world/scene.h"
#include "services/planning/planner.h"
#include "services/prediction/predictor.h"

namespace {

chase::prediction::PredictResult Predict(const chase::world::Scene& scene) {
  chase::prediction::PredictRequest request;
  for (const auto& o : scene.observations)
    request.observations.push_back({o.t, o.mean, o.covariance});
  request.obstacles = scene.obstacles;
  chase::prediction::PredictorConfig config;
  config.horizon = scene.horizon_s;
  return chase::prediction::Predictor(config).Predict(request);
}

chase::planning::PlanResult Plan(const chase::world::Scene& scene) {
  chase::planning::PlanRequest request;
  request.horizon = scene.horizon_s;
  request.start = scene.initial;
  request.target = scene.target;
  request.obstacles = scene.obstacles;
  return chase::planning::MakePlanner("chase", {})->Plan(request);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto prediction = Predict(chase::world::LoadScene(argv[1]));
  const auto plan = Plan(chase::world::LoadScene(argv[2]));
  const Eigen::Vector3d target = prediction.trajectory.Position(prediction.trajectory.end());
  std::printf("target in %.1f s at %.2f %.2f %.2f; plan: %s, %d of %d candidates checked\n",
              prediction.trajectory.duration, target.x(), target.y(), target.z(),
              chase::planning::Name(plan.verdict), plan.checked, plan.generated);
  const bool predicted = prediction.verdict == chase::prediction::PredictResult::Verdict::kOk;
  return predicted && plan.verdict == chase::planning::Verdict::kChase ? 0 : 1;
}
