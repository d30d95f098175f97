#include "test/odometry/live_trial.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "common/world/random.h"
#include "services/odometry/odometry.h"
#include "services/simulator/simulator.h"
#include "test/odometry/courses.h"

namespace chase::odometry::trial {

namespace {

using Eigen::Vector3d;

constexpr double kTick = 0.005;          // s
constexpr double kStanding = 0.12;       // m, of the body on its legs
constexpr double kUsableVelocity = 0.2;  // m/s

struct Pair {
  double t;
  Vector3d error, sigma, estimate, truth;
  double velocity_error;
};

/// Angle between up as estimated and up [deg].
double Tilt(const Eigen::Quaterniond& estimate, const Eigen::Quaterniond& truth) {
  const Vector3d up = estimate * (truth.conjugate() * Vector3d::UnitZ());
  return std::atan2(up.head<2>().norm(), up.z()) * 180.0 / M_PI;
}

Sweep FromSimulator(const simulator::Sweep& from) {
  Sweep sweep;
  sweep.start = from.start;
  sweep.points.resize(from.x.size());
  for (size_t i = 0; i < from.x.size(); ++i)
    sweep.points[i] = {
        {from.x[i], from.y[i], from.z[i]}, from.t[i], from.intensity[i], from.ring[i]};
  return sweep;
}

/// Simulator, pilot and odometry, stepped together.
class Live {
 public:
  Live(const world::Scenario& scenario, const LiveOptions& options)
      : options_(options),
        settle_(scenario.settle_s),
        course_(options.course, scenario),
        law_(control::ControlConfig{}),
        simulator_(scenario, Sensors(options)),
        odometry_(Start(scenario)) {}

  LiveFigures Run() {
    for (int i = 0; i * kTick <= options_.duration; ++i) Step(i * kTick);
    Judge();
    return figures_;
  }

 private:
  static simulator::SimulatorConfig Sensors(const LiveOptions& options) {
    simulator::SimulatorConfig config;
    config.seed = options.seed;
    config.camera.rate = 0.0;
    return config;
  }

  static OdometryConfig Start(const world::Scenario& scenario) {
    OdometryConfig config;
    config.initial_position = scenario.chaser.start;
    config.filter.mount_sigma = 1e-4;  // the mounting is exact here
    config.initial_yaw_deg = scenario.chaser.yaw_deg;
    return config;
  }

  void Step(double t) {
    simulator::Output out = simulator_.Advance(t);
    Steer(t, out.truth);
    if (Out(t)) out.imu.accel += options_.accel_fault;
    Strike(t, &out.imu);
    truth_.emplace_back(t, out.truth);
    if (truth_.size() > 400) truth_.pop_front();
    if (options_.imu && t >= options_.imu_from)
      waiting_.push_back({t, out.imu.accel, out.imu.gyro});
    const double delay = Within(options_.delay_from, t) ? options_.imu_delay : 0.0;
    for (; !waiting_.empty() && waiting_.front().t <= t - delay; waiting_.pop_front())
      See(odometry_.AddImu(waiting_.front()));
    if (out.sweep && Within(options_.clock_from, t)) out.sweep->start += options_.clock_step;
    if (out.sweep && !Out(out.sweep->start)) odometry_.AddSweep(FromSimulator(*out.sweep));
    while (odometry_.SweepReady()) {
      const SweepResult result = odometry_.ProcessSweep();
      if (!result.registered) continue;
      if (figures_.sweeps++ > 0 && !result.applied) ++figures_.refused;
      See(result.pose);
    }
  }

  void Strike(double t, simulator::ImuSample* imu) {
    if (t >= options_.jump_from) {
      imu->gyro.array() += options_.gyro_jump;
      imu->accel.array() += options_.accel_jump;
    }
    if (!Within(options_.spikes_from, t)) return;
    if (burst_ == 0 && random_.Uniform() < options_.spikes_share) {
      burst_ = 1 + static_cast<int>(random_.Next() % static_cast<uint64_t>(options_.spike_length));
      const double sign = random_.Next() & 1 ? 1.0 : -1.0;
      spike_ = sign * options_.spike_size * Vector3d::Unit(static_cast<int>(random_.Next() % 3));
    }
    if (burst_ == 0) return;
    --burst_;
    for (int k = 0; k < 3; ++k)
      if (spike_[k] != 0.0)
        imu->accel[k] = 16.0 * 9.81 * spike_[k], imu->gyro[k] = 2000.0 * M_PI / 180.0 * spike_[k];
  }

  static bool Within(double from, double t) { return t >= from && t < from + 2.0; }

  bool Out(double t) const { return t >= options_.lidar_out_from && t < options_.lidar_out_to; }

  void Steer(double t, const simulator::Truth& truth) {
    const double mission = truth.mission_time;
    if (!course_.Flies() || mission < Course::kTakeoff || t >= options_.land_at) return;
    const control::Estimate body{truth.body.p, truth.body.v, truth.body.q};
    const control::Setpoint setpoint = law_.Track(
        body, course_.At(mission), course_.At(mission + 0.02), mission > -5.0 ? 0.01 : 0.0);
    simulator_.SetSetpoint({setpoint.R_WB, setpoint.w_WB_B, setpoint.thrust}, t);
  }

  void See(const std::optional<PoseEstimate>& pose) {
    if (!pose || pose->health.health == Health::kStarting) return;
    const auto later = [](const auto& entry, double t) { return entry.first < t - 1e-6; };
    const auto at = std::lower_bound(truth_.begin(), std::prev(truth_.end()), pose->t, later);
    const simulator::Truth& truth = at->second;
    figures_.lost += pose->health.health == Health::kLost ? 1 : 0;
    figures_.epochs = pose->epoch;
    const double velocity_error = (pose->v - truth.body.v).norm();
    const bool back = pose->t >= options_.lidar_out_to;
    if (back && !figures_.velocity_back && velocity_error < kUsableVelocity)
      figures_.velocity_back = pose->t - options_.lidar_out_to;
    const bool ok = pose->health.health == Health::kOk;
    const double tilt = Tilt(pose->X_WB.R, truth.body.q);
    if (pose->t < options_.lidar_out_from) tilt_before_ = tilt;
    if (ok && back)
      figures_.tilt = std::max(figures_.tilt.value_or(-HUGE_VAL), tilt - tilt_before_);
    if (pose->t < options_.judge_from) return;
    figures_.degraded += ok ? 0 : 1;
    figures_.turned =
        std::max(figures_.turned, 180.0 / M_PI * pose->X_WB.R.angularDistance(truth.body.q));
    pairs_.push_back({pose->t, pose->X_WB.p - truth.body.p,
                      pose->covariance.diagonal().head<3>().cwiseSqrt(), pose->X_WB.p, truth.body.p,
                      velocity_error});
  }

  void Judge() {
    if (pairs_.empty()) return;
    if (!options_.imu) CountFromTheFirstSecond();
    const double n = static_cast<double>(pairs_.size());
    Eigen::Matrix3Xd a(3, pairs_.size()), b(3, pairs_.size());
    Vector3d squares = Vector3d::Zero();
    for (size_t i = 0; i < pairs_.size(); ++i) {
      const Pair& pair = pairs_[i];
      a.col(static_cast<long>(i)) = pair.estimate;
      b.col(static_cast<long>(i)) = pair.truth;
      squares += pair.error.cwiseAbs2();
      figures_.worst = std::max(figures_.worst, pair.error.norm());
      figures_.worst_velocity = std::max(figures_.worst_velocity, pair.velocity_error);
      figures_.moved = std::max(figures_.moved, (pair.error - pairs_[0].error).norm());
      for (int k = 0; k < 3; ++k)
        figures_.covered[k] += std::abs(pair.error[k]) <= 3.0 * pair.sigma[k] ? 1.0 / n : 0.0;
    }
    const Eigen::Isometry3d fit(Eigen::umeyama(a, b, false));
    figures_.aligned = std::sqrt(((fit * a) - b).squaredNorm() / n);
    figures_.ate = std::sqrt(squares.sum() / n);
    figures_.end = pairs_.back().error.norm();
    for (int k = 0; k < 3; ++k) figures_.sigma[k] = MedianSigma(k);
    for (int k = 0; k < 3; ++k) figures_.rms[k] = std::sqrt(squares[k] / n);
  }

  void CountFromTheFirstSecond() {
    Vector3d mean = Vector3d::Zero();
    double n = 0.0;
    for (const Pair& pair : pairs_)
      if (pair.t < pairs_[0].t + 1.0) mean += pair.error, n += 1.0;
    for (Pair& pair : pairs_) pair.error -= mean / n;
  }

  double MedianSigma(int axis) const {
    std::vector<double> sigma;
    for (const Pair& pair : pairs_) sigma.push_back(pair.sigma[axis]);
    std::nth_element(sigma.begin(), sigma.begin() + static_cast<long>(sigma.size() / 2),
                     sigma.end());
    return sigma[sigma.size() / 2];
  }

  LiveOptions options_;
  double settle_;
  Course course_;
  control::TrackingLaw law_;
  simulator::Simulator simulator_;
  Odometry odometry_;
  world::Random random_{3};
  double tilt_before_ = 0.0;  // when the LiDAR went out, deg
  int burst_ = 0;             // samples that a spike still lasts
  Vector3d spike_ = Vector3d::Zero();
  std::deque<ImuSample> waiting_;                          // that come late
  std::deque<std::pair<double, simulator::Truth>> truth_;  // of late
  std::vector<Pair> pairs_;
  LiveFigures figures_;
};

}  // namespace

LiveFigures FlyLive(const world::Scenario& scenario, const LiveOptions& options) {
  return Live(scenario, options).Run();
}

world::Scenario Meadow(int trees, double roughness, uint64_t seed) {
  world::Random random(seed, 77);
  world::Scenario scenario;
  scenario.name = fmt::format("meadow-{}", seed);
  scenario.world.ground.roughness = roughness;
  scenario.world.ground.wavelength = random.Uniform(6.0, 12.0);
  scenario.target.waypoints = {{-8.0, -6.0}, {8.0, -6.0}, {8.0, 6.0}, {-8.0, 6.0}};
  scenario.target.speed = random.Uniform(1.0, 3.0);
  scenario.target.corner_radius = 3.0;
  scenario.world.forest.count = trees;
  scenario.world.forest.min = {-28.0, -22.0};
  scenario.world.forest.max = {28.0, 22.0};
  scenario.world.forest.gap = 1.5;
  scenario.world.forest.seed = static_cast<int>(seed);
  scenario.chaser.start = {-11.0, -6.0, 0.0};
  scenario.chaser.start.z() = world::GroundHeight(scenario.world.ground, -11.0, -6.0) + kStanding;
  scenario.wind = {{random.Uniform(-1.5, 1.5), random.Uniform(-1.5, 1.5), 0.0}, 0.5, 2.0};
  return scenario;
}

world::Scenario BareStreet(bool posts) {
  world::Scenario scenario;
  scenario.name = "bare street";
  for (const double y : {-6.1, 6.1})
    scenario.world.walls.push_back({{-150.0, y}, {150.0, y}, 6.0, 0.2});
  for (int i = 0; posts && i < 8; ++i)
    scenario.world.cylinders.push_back({{-2.0 + 3.0 * i, i % 2 ? 4.0 : -4.0}, 0.5, 4.0, 0.0});
  scenario.target.waypoints = {{-30.0, 0.0}, {30.0, 0.0}};
  scenario.target.speed = 1.5;
  scenario.target.corner_radius = 3.0;
  scenario.chaser.start = {-33.0, 0.0, kStanding};
  return scenario;
}

world::Scenario Square(uint64_t seed) {
  world::Random random(seed, 78);
  world::Scenario scenario;
  scenario.name = fmt::format("square-{}", seed);
  const double x = random.Uniform(13.0, 19.0), y = random.Uniform(10.0, 14.0);
  for (const double side : {-y, y})
    scenario.world.walls.push_back({{-x, side}, {x, side}, 5.0, 0.2});
  for (int i = 0; i < 4; ++i)
    scenario.world.cylinders.push_back(
        {{random.Uniform(-x, x), random.Uniform(2.0, y)}, random.Uniform(0.15, 0.4), 4.0, 0.0});
  scenario.target.waypoints = {{-4.0, -4.0}, {4.0, -4.0}};
  scenario.chaser.start = {-4.0, -6.0, kStanding};
  return scenario;
}

world::Scenario Passage(uint64_t seed) {
  world::Random random(seed, 79);
  world::Scenario scenario;
  scenario.name = fmt::format("passage-{}", seed);
  const double length = random.Uniform(10.0, 30.0), height = random.Uniform(2.5, 3.5);
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    scenario.world.walls.push_back({{x0, y0}, {x1, y1}, height, 0.15});
  };
  for (const double side : {-1.0, 1.0}) {
    const double y = side * random.Uniform(1.0, 2.0), depth = side * random.Uniform(4.0, 7.0);
    double from = 0.0;
    for (double door = random.Uniform(2.0, 8.0); door < length - 2.0;
         from = door + 1.4, door += random.Uniform(3.0, 9.0)) {
      wall(from, y, door, y);
      const double between = door - 0.5;
      if (random.Uniform() < 0.5) wall(between, y, between, depth);
    }
    wall(from, y, length, y);
    wall(0.0, depth, length, depth);
  }
  for (const double end : {0.0, length}) wall(end, -8.0, end, 8.0);
  for (int i = 0; i < 6; ++i)
    scenario.world.boxes.push_back(
        {{random.Uniform(0.5, length), random.Uniform(2.5, 4.0) * (i % 2 ? 1.0 : -1.0), 0.4},
         {random.Uniform(0.4, 1.4), random.Uniform(0.4, 1.4), 0.8}});
  scenario.chaser.start = {random.Uniform(0.8, 3.0), random.Uniform(-0.4, 0.4), kStanding};
  scenario.chaser.yaw_deg = random.Uniform(-180.0, 180.0);
  scenario.chaser.takeoff_height = random.Uniform(0.8, 1.5);
  scenario.target.waypoints = {{4.0, 0.0}, {6.0, 0.0}};
  return scenario;
}

std::string Text(const LiveFigures& f) {
  return fmt::format(
      "\"sweeps\":{},\"refused\":{},\"lost\":{},\"degraded\":{},\"epochs\":{},\"ate\":{:.4f},"
      "\"aligned\":{:.4f},"
      "\"worst\":{:.3f},\"end\":{:.3f},\"moved\":{:.4f},\"velocity_back\":{:.3f},"
      "\"tilt\":{:.3f},"
      "\"covered\":[{:.3f},{:.3f},{:.3f}],\"sigma_mm\":[{:.1f},{:.1f},{:.1f}],\"rms_mm\":[{:.1f},{:"
      ".1f},"
      "{:.1f}]",
      f.sweeps, f.refused, f.lost, f.degraded, f.epochs, f.ate, f.aligned, f.worst, f.end, f.moved,
      f.velocity_back.value_or(-1.0), f.tilt.value_or(-1.0), f.covered[0], f.covered[1],
      f.covered[2], 1e3 * f.sigma[0], 1e3 * f.sigma[1], 1e3 * f.sigma[2], 1e3 * f.rms[0],
      1e3 * f.rms[1], 1e3 * f.rms[2]);
}

}  // namespace chase::odometry::trial
