// chase-predict SCENE.yaml: one prediction problem from a file, result as JSON on stdout.

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/config/config.h"
#include "common/config/version.h"
#include "common/world/scene.h"
#include "services/prediction/predictor.h"

namespace {

using chase::prediction::PredictorConfig;
using chase::prediction::PredictRequest;
using chase::prediction::PredictResult;
using nlohmann::ordered_json;

PredictRequest MakeRequest(const chase::world::Scene& scene, const std::string& file) {
  if (scene.observations.size() < 2)
    throw std::runtime_error(file + ": observations: has " +
                             std::to_string(scene.observations.size()) +
                             " entries, must be 2 to 32; a forecast needs where the target was");
  if (scene.observations.size() > 32)
    throw std::runtime_error(file + ": observations: has " +
                             std::to_string(scene.observations.size()) +
                             " entries, must be 2 to 32; merge or leave out old ones");
  PredictRequest request;
  for (const auto& o : scene.observations)
    request.observations.push_back({o.t, o.mean, o.covariance});
  request.obstacles = scene.obstacles;
  return request;
}

// The scene's horizon stands unless the overrides name one.
PredictorConfig MakeConfig(const chase::world::Scene& scene, const std::string& file) {
  PredictorConfig config;
  config.horizon = scene.horizon_s;
  if (!scene.predictor.empty())
    chase::config::LoadText(scene.predictor, file + " (predictor)", &config);
  const std::string problem = config.Problem();
  if (!problem.empty()) throw std::runtime_error(file + ": " + problem);
  return config;
}

const char* Name(PredictResult::Verdict verdict) {
  switch (verdict) {
    case PredictResult::Verdict::kOk:
      return "OK";
    case PredictResult::Verdict::kColliding:
      return "COLLIDING";
    case PredictResult::Verdict::kNoTarget:
      break;
  }
  return "NO_TARGET";
}

ordered_json Rows(const Eigen::MatrixXd& matrix) {
  ordered_json rows = ordered_json::array();
  for (Eigen::Index k = 0; k < matrix.rows(); ++k)
    rows.push_back({matrix(k, 0), matrix(k, 1), matrix(k, 2)});
  return rows;
}

ordered_json ToJson(const PredictResult& result, double predict_us) {
  ordered_json out;
  out["verdict"] = Name(result.verdict);
  out["reason"] = result.reason;
  out["duration_s"] = result.trajectory.duration;
  out["coefficients"] = Rows(result.trajectory.coefficients);
  out["cost"] = result.cost;
  out["candidates"] = {{"total", result.candidates}, {"checked", result.checked}};
  out["gap"] = result.gap;
  out["free_share"] = result.free_share;
  out["obstacles_in_reach"] = result.obstacles;
  out["position_covariance"] = Rows(result.position_covariance);
  out["velocity_covariance"] = Rows(result.velocity_covariance);
  out["timings_us"] = {{"predict", predict_us}};
  return out;
}

ordered_json Answer(const std::string& file) {
  const chase::world::Scene scene = chase::world::LoadScene(file);
  const PredictRequest request = MakeRequest(scene, file);
  const chase::prediction::Predictor predictor(MakeConfig(scene, file));
  const auto start = std::chrono::steady_clock::now();
  const PredictResult result = predictor.Predict(request);
  const std::chrono::duration<double, std::micro> us = std::chrono::steady_clock::now() - start;
  return ToJson(result, us.count());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Predicts the target once: a scene file in, JSON out.", "chase-predict");
  chase::config::AddVersion(&app);
  std::string file;
  app.add_option("SCENE", file, "scene file, see deploy/scenarios/scenes/README.md")->required();
  try {
    app.parse(argc, argv);
    std::printf("%s\n", Answer(file).dump(2).c_str());
    return 0;
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "chase-predict: %s; see chase-predict --help\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-predict: %s\n", e.what());
  }
  return 1;
}
