#include "deploy/worlds/outfit.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "common/config/changes.h"
#include "deploy/worlds/rounding.h"
#include "services/control/control_config.h"
#include "services/perception/tools/learn.h"
#include "services/prediction/prediction_node.h"

namespace chase::worlds {

using Eigen::Vector3d;

namespace {

// What a careful calibration leaves, standard deviations.
constexpr double kPositionError = 0.003;  // m
constexpr double kAngleError = 0.1;       // degrees

Vector3d GaussianVector(double sigma, Random* random) {
  const double x = random->Gaussian(), y = random->Gaussian(), z = random->Gaussian();
  return sigma * Vector3d(x, y, z);
}

world::Rig DrawRig(Random* random) {
  world::Rig rig;
  rig.lidar_position = {random->Uniform(-0.05, 0.05), random->Uniform(-0.02, 0.02),
                        random->Uniform(0.06, 0.14)};
  rig.lidar_rpy_deg = {random->Uniform(-3.0, 3.0), random->Uniform(-3.0, 3.0),
                       random->Uniform(-3.0, 3.0)};
  rig.camera_position = {random->Uniform(0.08, 0.15), random->Uniform(-0.02, 0.02),
                         random->Uniform(-0.04, 0.04)};
  rig.camera_pitch_deg = random->Uniform(8.0, 16.0);
  return rig;
}

world::Rig Calibrated(world::Rig rig, Random* random) {
  rig.lidar_position += GaussianVector(kPositionError, random);
  rig.lidar_rpy_deg += GaussianVector(kAngleError, random);
  rig.camera_position += GaussianVector(kPositionError, random);
  rig.camera_pitch_deg += kAngleError * random->Gaussian();
  return rig;
}

/// 5 to 10 % away, with a random sign, from what control believes.
void DrawVehicle(Random* random, simulator::VehicleConfig* vehicle) {
  const control::ControlConfig believed;
  const double hover = simulator::kGravity / vehicle->max_thrust;  // share of the most
  vehicle->mass_error = Signed(random, 0.05, 0.10);
  vehicle->thrust_curve = Signed(random, 0.05, 0.10) / (1.0 - hover);  // so much at the hover
  for (int i = 0; i < 3; ++i)
    vehicle->drag[i] = believed.drag[i] * (1.0 + Signed(random, 0.05, 0.10));
}

void DrawNoise(Random* random, simulator::SimulatorConfig* config) {
  const auto vary = [&](double* value) { *value *= std::exp(random->Uniform(-0.7, 0.7)); };
  for (double* value : {&config->imu.accel_noise, &config->imu.gyro_noise, &config->imu.accel_bias,
                        &config->imu.gyro_bias, &config->imu.accel_walk, &config->imu.gyro_walk})
    vary(value);
  config->lidar.noise = random->Uniform(0.01, 0.03);
  config->lidar.dropout = random->Uniform(0.0, 0.02);
  config->camera.noise = random->Uniform(1.5, 5.0);
  config->camera.exposure_variation = random->Uniform(0.03, 0.2);
  config->camera.light = random->Uniform(0.5, 1.0);
}

/// A photo and where the target is in it: 255 on it, 0 off it.
struct Photo {
  cv::Mat bgr, mask;
};

cv::Mat Mask(const world::Rig& rig, const simulator::Viewpoint& view,
             const simulator::Scene& scene) {
  cv::Mat mask = cv::Mat::zeros(rig.height_px, rig.width_px, CV_8U);
  for (int row = 0; row < rig.height_px; ++row)
    for (int column = 0; column < rig.width_px; column += 8) {
      simulator::RayPacket rays;
      rays.count = std::min(8, rig.width_px - column);
      for (int i = 0; i < rays.count; ++i) {
        const Vector3d d_C((column + i - rig.center_u_px) / rig.focal_px,
                           (row - rig.center_v_px) / rig.focal_px, 1.0);
        const Eigen::Vector3f d = (view.R_WC * d_C).cast<float>(), o = view.p_WC.cast<float>();
        rays.ox[i] = o.x(), rays.oy[i] = o.y(), rays.oz[i] = o.z();
        rays.dx[i] = d.x(), rays.dy[i] = d.y(), rays.dz[i] = d.z();
      }
      simulator::HitPacket hits;
      scene.Trace(rays, &hits);
      for (int i = 0; i < rays.count; ++i)
        if (hits.material[i] == simulator::Material::kTarget) mask.at<uchar>(row, column + i) = 255;
    }
  return mask;
}

cv::Mat Bgr(const simulator::Image& image) {
  cv::Mat bgr(image.height, image.width, CV_8UC3);
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const uint8_t* rgb = &image.rgb[static_cast<std::size_t>(3 * (row * image.width + column))];
      bgr.at<cv::Vec3b>(row, column) = {rgb[2], rgb[1], rgb[0]};
    }
  return bgr;
}

/// The world around the target taken away: its photos are taken in the open.
world::Scenario InTheOpen(world::Scenario scenario) {
  const world::GroundSpec ground = scenario.world.ground;
  scenario.world = {};
  scenario.world.ground.height = ground.height;
  scenario.movers.clear();
  scenario.target.waypoints = {{0.0, 0.0}, {1.0, 0.0}};
  scenario.target.stops.clear();
  scenario.chaser.start = {-3.0, 0.0, 0.0};
  return scenario;
}

}  // namespace

Outfit DrawOutfit(Random* random) {
  Outfit outfit;
  outfit.simulator.rig = Rounded(DrawRig(random), 3);
  outfit.calibrated = Rounded(Calibrated(outfit.simulator.rig, random), 4);
  DrawVehicle(random, &outfit.simulator.vehicle);
  DrawNoise(random, &outfit.simulator);
  outfit.simulator = Rounded(outfit.simulator, 5);
  return outfit;
}

Vector3d DrawColor(Random* random) {
  const double hue =
      Chance(random, 0.7) ? random->Uniform(-8.0, 50.0) : random->Uniform(290.0, 335.0);
  const double saturation = random->Uniform(0.85, 1.0), value = random->Uniform(0.75, 1.0);
  Vector3d rgb;
  for (int i = 0; i < 3; ++i) {  // channel by channel: Smith 1978
    const double k = std::fmod((i == 0 ? 5.0 : i == 1 ? 3.0 : 1.0) + hue / 60.0 + 6.0, 6.0);
    rgb[i] = value * (1.0 - saturation * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  }
  return rgb;
}

perception::PerceptionConfig LearnTarget(const world::Scenario& world, const Outfit& outfit,
                                         uint64_t seed) {
  const world::Scenario scenario = InTheOpen(world);
  const simulator::Scene scene(scenario);
  const world::Rig& rig = outfit.simulator.rig;
  simulator::Camera camera(outfit.simulator.camera, rig, scenario.target.color, seed);
  const simulator::TargetState target = simulator::Actors(scenario).Target(0.0);
  std::vector<cv::Mat> images, masks;
  const double distance = scenario.chaser.desired_distance;
  for (int i = 0; i < 4; ++i) {  // around it, nearer and farther than it will be chased
    const double angle = 0.4 + 1.7 * i, range = distance * (0.7 + 0.25 * i);
    const Eigen::Vector2d beside = Polar(angle, range);
    const Vector3d p(beside.x(), beside.y(), target.center.z() + 0.17 * range);
    const Eigen::Quaterniond q(Eigen::AngleAxisd(angle + kPi, Vector3d::UnitZ()));
    images.push_back(Bgr(camera.Render(p, q, 1.7 * i, scene, target.cylinder)));
    masks.push_back(
        Mask(rig, {p + q * rig.camera_position, q.toRotationMatrix() * rig.R_BC()}, scene));
  }
  perception::PerceptionConfig config;
  config.detector = LearnDetector(images, masks, config.detector).config;
  config.rig = outfit.calibrated;
  config.target_shape = world.target.shape;
  config.target_radius = world.target.radius;
  config.target_height = world.target.height;
  return Rounded(config, 4);
}

void WriteServices(const Outfit& outfit, const perception::PerceptionConfig& learned,
                   world::Scenario* scenario) {
  odometry::OdometryConfig odometry;
  odometry.rig = outfit.calibrated;
  perception::PerceptionConfig derived;  // from the scenario itself
  derived.target_shape = learned.target_shape;
  derived.target_radius = scenario->target.radius;
  derived.target_height = scenario->target.height;
  planning::PlanningConfig planning;
  prediction::PredictionConfig prediction;
  if (scenario->world.forest.count > 200) planning.planner.skeletons = 8;
  if (!scenario->world.ground.slope.isZero()) prediction.predictor.planar = false;
  scenario->services.clear();
  const auto add = [&](const std::string& name, const std::string& text) {
    if (!text.empty()) scenario->services.push_back({name, text});
  };
  add("simulator", config::DumpChanges(outfit.simulator));
  add("odometry", config::DumpChanges(odometry));
  add("perception", config::DumpChanges(learned, derived));
  add("planning", config::DumpChanges(Rounded(planning, 6)));
  add("prediction", config::DumpChanges(prediction));
}

}  // namespace chase::worlds
