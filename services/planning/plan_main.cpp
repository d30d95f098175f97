// chase-plan SCENE.yaml [--planner NAME]: one planning problem from a file, result as JSON on
// stdout.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/config/config.h"
#include "common/config/version.h"
#include "common/world/scene.h"
#include "services/planning/planner.h"

namespace {

using chase::planning::PlannerConfig;
using chase::planning::PlanRequest;
using chase::planning::PlanResult;
using nlohmann::ordered_json;

PlanRequest MakeRequest(const chase::world::Scene& scene, const std::string& file) {
  if (!scene.has_initial)
    throw std::runtime_error(file + ": missing key 'initial': give p of the drone, m");
  if (!scene.has_target)
    throw std::runtime_error(file + ": missing key 'target': give its coefficients");
  PlanRequest request;
  request.horizon = scene.horizon_s;
  request.start = scene.initial;
  request.target = scene.target;
  request.obstacles = scene.obstacles;
  return request;
}

ordered_json Rows(const chase::world::Trajectory& trajectory) {
  ordered_json rows = ordered_json::array();
  for (int k = 0; k <= trajectory.degree(); ++k)
    rows.push_back({trajectory.coefficients(k, 0), trajectory.coefficients(k, 1),
                    trajectory.coefficients(k, 2)});
  return rows;
}

ordered_json ToJson(const PlanResult& plan, const std::string& planner, double plan_us) {
  const auto& c = plan.cost;
  ordered_json out;
  out["verdict"] = chase::planning::Name(plan.verdict);
  out["reason"] = plan.reason;
  out["planner"] = planner;
  out["duration_s"] = plan.trajectory.duration;
  out["coefficients"] = Rows(plan.trajectory);
  out["yaw"] = plan.yaw;
  out["cost"] = {{"j1", c.j1}, {"j2", c.j2}, {"j3", c.j3}, {"j4", c.j4}, {"total", c.total}};
  out["candidates"] = {
      {"generated", plan.generated}, {"checked", plan.checked}, {"feasible", plan.feasible}};
  out["winner"] = plan.winner;
  out["timings_us"] = {{"plan", plan_us}};
  return out;
}

/// Processor time of this process, microseconds.
double CpuMicroseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

ordered_json Answer(const std::string& file, const std::string& planner_name) {
  const chase::world::Scene scene = chase::world::LoadScene(file);
  PlannerConfig config = PlannerConfig::Literal();
  if (!scene.planner.empty()) chase::config::LoadText(scene.planner, file + " (planner)", &config);
  const PlanRequest request = MakeRequest(scene, file);
  const auto planner = chase::planning::MakePlanner(planner_name, config);
  const double before = CpuMicroseconds();
  const PlanResult plan = planner->Plan(request);
  return ToJson(plan, planner_name, CpuMicroseconds() - before);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Plans one chase: a scene file in, JSON out.", "chase-plan");
  chase::config::AddVersion(&app);
  std::string file;
  std::string planner = "chase";
  app.add_option("SCENE", file, "scene file, see deploy/scenarios/scenes/README.md")->required();
  app.add_option("--planner", planner, "chase, reference or reference-double");
  try {
    app.parse(argc, argv);
    std::printf("%s\n", Answer(file, planner).dump(2).c_str());
    return 0;
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "chase-plan: %s; see chase-plan --help\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-plan: %s\n", e.what());
  }
  return 1;
}
