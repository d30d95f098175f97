#include "test/compare/mission.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "common/config/config.h"
#include "common/world/scenario.h"

namespace chase::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<world::Obstacle> Obstacles(const world::Scenario& scenario, const std::string& file) {
  std::vector<world::Obstacle> obstacles;
  for (const world::Solid& solid : world::StaticSolids(scenario)) {
    if (solid.kind != world::Solid::Kind::kEllipsoid || solid.yaw != 0.0)
      throw std::runtime_error(file +
                               ": the comparison knows upright ellipsoids only; put every obstacle "
                               "under world.ellipsoids without yaw_deg");
    world::Obstacle o;
    o.id = static_cast<int>(obstacles.size());
    o.center = world::Trajectory::Constant(solid.center, 0.0, scenario.duration_s);
    o.shape = solid.half_size.array().square().inverse().matrix().asDiagonal();
    obstacles.push_back(o);
  }
  return obstacles;
}

int SeedOf(const std::string& name) {
  const size_t at = name.rfind("-seed");
  return at == std::string::npos ? 1 : std::atoi(name.c_str() + at + 5);
}

planning::PlanningConfig Planning(const world::Scenario& scenario, const std::string& file) {
  planning::PlanningConfig config;
  config.planner.desired_distance = scenario.chaser.desired_distance;
  config.planner.minkowski_sums = false;  // the comparison's ellipsoids are the obstacles
  config.planner.drone_radius = scenario.chaser.radius;
  config::LoadText(world::ServiceConfig(scenario, "planning"), file + ", services: planning",
                   &config);
  return config;
}

}  // namespace

std::string ScenarioFile(const std::string& scenario) {
  const bool is_file =
      scenario.find('/') != std::string::npos || scenario.find(".yaml") != std::string::npos;
  return is_file ? scenario : std::string(CHASE_TWELVE) + "/" + scenario + ".yaml";
}

Mission LoadMission(const std::string& scenario_name) {
  const std::string file = ScenarioFile(scenario_name);
  const world::Scenario scenario = world::LoadScenario(file);
  Mission mission;
  mission.name = scenario.name;
  mission.seed = SeedOf(scenario.name);
  mission.duration = scenario.duration_s;
  mission.desired_distance = scenario.chaser.desired_distance;
  mission.drone_radius = scenario.chaser.radius;
  mission.target_height = scenario.target.base + 0.5 * scenario.target.height;
  mission.obstacles = Obstacles(scenario, file);
  mission.path = world::TargetMotion(scenario);
  mission.planning = Planning(scenario, file);
  if (mission.path.Duration() < mission.duration + mission.planning.horizon - 1e-6)
    throw std::runtime_error(file + ": the target's path ends before duration_s plus the horizon");
  return mission;
}

Vector3d Mission::Target(double t) const {
  const Vector2d p = path.Position(t);
  return {p.x(), p.y(), target_height};
}

Vector3d Mission::TargetVelocity(double t) const {
  constexpr double kFirst = 0.1;  // s; a sampled path is at rest at its very beginning
  const Vector2d v = t < kFirst ? Vector2d((path.Position(kFirst) - path.Position(0.0)) / kFirst)
                                : path.Velocity(t);
  return {v.x(), v.y(), 0.0};
}

std::vector<Eigen::Matrix3d> Mission::GrownShapes() const {
  std::vector<Eigen::Matrix3d> shapes;
  for (const world::Obstacle& o : obstacles)
    shapes.push_back(world::Inflated(o.shape, drone_radius));
  return shapes;
}

world::Trajectory FitTarget(const Mission& mission, double t0, double horizon) {
  constexpr int kTerms = 6, kSamples = 51;
  Eigen::Matrix<double, kSamples, kTerms> basis;
  Eigen::Matrix<double, kSamples, 3> points;
  for (int i = 0; i < kSamples; ++i) {
    const double tau = static_cast<double>(i) / (kSamples - 1);
    basis(i, 0) = 1.0;
    for (int k = 1; k < kTerms; ++k) basis(i, k) = basis(i, k - 1) * tau;
    points.row(i) = mission.Target(t0 + tau * horizon).transpose();
  }
  const Eigen::Matrix<double, kTerms, kTerms> normal = basis.transpose() * basis;
  return {t0, horizon, normal.ldlt().solve(basis.transpose() * points)};
}

world::State StartState(const Mission& mission) {
  constexpr int kBearings = 16;
  const Vector3d q = mission.Target(0.0);
  const auto shapes = mission.GrownShapes();
  world::State start;
  double best = -1.0;
  for (int i = 0; i < kBearings; ++i) {
    const double angle = 2.0 * M_PI * i / kBearings;
    const Vector3d p =
        q + mission.desired_distance * Vector3d(std::cos(angle), std::sin(angle), 0.0);
    double least = HUGE_VAL;
    for (size_t j = 0; j < shapes.size(); ++j)
      least = std::min(least, world::SegmentSquaredDistance(
                                  p, q, mission.obstacles[j].center.Position(0.0), shapes[j]));
    if (least <= best) continue;
    best = least;
    start.p = p;
  }
  start.v = mission.TargetVelocity(0.0);
  return start;
}

}  // namespace chase::compare
