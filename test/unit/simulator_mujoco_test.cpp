// MuJoCo as an independent model of rays and of rigid-body motion.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/world/random.h"
#include "common/world/scenario.h"
#include "services/simulator/quadrotor.h"
#include "services/simulator/scene.h"

namespace chase::simulator {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Model {
  explicit Model(const std::string& xml) {
    const std::string file = ::testing::TempDir() + "chase_mujoco_test.xml";
    std::ofstream(file) << xml;
    char error[500] = "";
    model = mj_loadXML(file.c_str(), nullptr, error, sizeof error);
    if (!model) throw std::runtime_error(error);
    data = mj_makeData(model);
    mj_forward(model, data);
  }
  ~Model() {
    mj_deleteData(data);
    mj_deleteModel(model);
  }
  mjModel* model = nullptr;
  mjData* data = nullptr;
};

std::string Geom(const world::Solid& solid) {
  const char* type = solid.kind == world::Solid::Kind::kBox        ? "box"
                     : solid.kind == world::Solid::Kind::kCylinder ? "cylinder"
                                                                   : "ellipsoid";
  const Vector3d& h = solid.half_size;
  std::ostringstream out;
  out.precision(17);
  out << "<geom type='" << type << "' pos='" << solid.center.transpose() << "' size='";
  if (solid.kind == world::Solid::Kind::kCylinder)
    out << h.x() << " " << h.z();
  else
    out << h.transpose();
  out << "' quat='" << std::cos(0.5 * solid.yaw) << " 0 0 " << std::sin(0.5 * solid.yaw) << "'/>\n";
  return out.str();
}

TEST(MuJoCo, AgreesOnRaysThroughTheGym) {
  const auto gym =
      world::LoadScenario(std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/gym.yaml");
  const TargetState target = Actors(gym).Target(0.0);
  std::string geoms =
      "<geom type='plane' size='0 0 1'/>" + Geom(target.cylinder) + Geom(target.carrier);
  for (const auto& solid : world::StaticSolids(gym)) geoms += Geom(solid);
  const Model oracle("<mujoco><worldbody>" + geoms + "</worldbody></mujoco>");
  Scene scene(gym);
  scene.MoveTo(0.0);
  world::Random random(9);
  int compared = 0, edges = 0;
  for (int n = 0; n < 2000; ++n) {
    RayPacket rays;
    for (int i = 0; i < 8; ++i) {
      const Vector3d d = Vector3d(random.Gaussian(), random.Gaussian(), 0.3 * random.Gaussian());
      const Eigen::Vector3f f = d.normalized().cast<float>();
      rays.ox[i] = static_cast<float>(random.Uniform(1.0, 14.0));
      rays.oy[i] = static_cast<float>(random.Uniform(-3.7, 3.7));
      rays.oz[i] = static_cast<float>(random.Uniform(1.0, 2.5));
      rays.dx[i] = f.x(), rays.dy[i] = f.y(), rays.dz[i] = f.z();
    }
    HitPacket hits;
    scene.Trace(rays, &hits);
    for (int i = 0; i < 8; ++i) {
      const mjtNum origin[3] = {rays.ox[i], rays.oy[i], rays.oz[i]};
      const mjtNum direction[3] = {rays.dx[i], rays.dy[i], rays.dz[i]};
      int geom = -1;
      const double range =
          mj_ray(oracle.model, oracle.data, origin, direction, nullptr, 1, -1, &geom);
      if (range < 0.0 || range > 50.0) continue;
      ++compared;
      edges += !(std::abs(range - hits.distance[i]) < 0.01);  // grazes an edge of the triangles
    }
  }
  EXPECT_GT(compared, 12000);
  EXPECT_LE(edges, compared / 500);
}

/// A free body thrown with a spin about no principal axis, without and with thrust along its z.
void CompareFlight(double thrust) {
  VehicleConfig config;
  config.drag.setZero();
  config.thrust_error = 0.0;
  config.inertia = {0.016, 0.021, 0.028};
  std::ostringstream xml;
  xml << "<mujoco><option timestep='0.001' integrator='RK4' gravity='0 0 -9.81'/><worldbody><body>"
      << "<freejoint/><inertial pos='0 0 0' mass='" << config.mass << "' diaginertia='"
      << config.inertia.transpose() << "'/></body></worldbody></mujoco>";
  const Model oracle(xml.str());
  BodyState start;
  start.p = {0.0, 0.0, 100.0};
  start.v = {1.0, -2.0, 3.0};
  start.w = {2.0, -1.0, 1.5};
  Quadrotor quadrotor(config, start, [](double, double) { return -1e6; });
  mjData* data = oracle.data;
  for (int k = 0; k < 3; ++k) {
    data->qpos[k] = start.p[k];
    data->qvel[k] = start.v[k];
    data->qvel[k + 3] = start.w[k];
  }
  for (int i = 0; i < 2000; ++i) {
    quadrotor.Step({thrust, Vector3d::Zero()}, Vector3d::Zero(), 1e-3);
    const double force = quadrotor.motor_thrusts().sum();
    const Quaterniond q(data->qpos[3], data->qpos[4], data->qpos[5], data->qpos[6]);
    const Vector3d f = q * Vector3d(0.0, 0.0, force);
    for (int k = 0; k < 3; ++k) data->xfrc_applied[6 + k] = f[k];
    mj_step(oracle.model, data);
  }
  const BodyState& body = quadrotor.state();
  const Quaterniond q(data->qpos[3], data->qpos[4], data->qpos[5], data->qpos[6]);
  EXPECT_LT((body.p - Vector3d(data->qpos[0], data->qpos[1], data->qpos[2])).norm(), 0.02);
  EXPECT_LT((body.v - Vector3d(data->qvel[0], data->qvel[1], data->qvel[2])).norm(), 0.02);
  EXPECT_LT((body.w - Vector3d(data->qvel[3], data->qvel[4], data->qvel[5])).norm(), 0.01);
  EXPECT_LT(body.q.angularDistance(q), 0.01);
  EXPECT_GT((body.w - start.w).norm(),
            0.2);  // the spin has wandered: the comparison says something
}

TEST(MuJoCo, AgreesOnAFreeTumble) { CompareFlight(0.0); }
TEST(MuJoCo, AgreesOnATumbleUnderThrust) { CompareFlight(12.0); }

}  // namespace
}  // namespace chase::simulator
