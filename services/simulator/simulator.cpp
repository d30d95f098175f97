#include "services/simulator/simulator.h"

#include <algorithm>
#include <cmath>

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

constexpr double kStep = 1e-3;        // s
constexpr double kHoverMemory = 2.0;  // s: above the motors' 0.05 s, below a battery's minutes
constexpr double kPi = 3.14159265358979323846;

/// Standing on its legs where the scenario puts it, or in the air if that is higher.
BodyState StartState(const world::Scenario& scenario, const VehicleConfig& vehicle) {
  const Vector3d& start = scenario.chaser.start;
  const double ground = world::GroundHeight(scenario.world.ground, start.x(), start.y());
  BodyState state;
  state.p = {start.x(), start.y(), std::max(start.z(), ground + StandingHeight(vehicle))};
  state.q = Eigen::AngleAxisd(scenario.chaser.yaw_deg * kPi / 180.0, Vector3d::UnitZ());
  return state;
}

/// s on the target's path; 0: no decoy in this flight.
double DecoyLead(const std::vector<world::FaultSpec>& faults) {
  for (const world::FaultSpec& fault : faults)
    if (const world::FaultKind& kind = world::KindOf(fault);
        kind.effect == world::FaultKind::Effect::kDecoy)
      return kind.amount;
  return 0.0;
}

std::string Named(const std::string& name, const std::string& problem) {
  return problem.empty() ? "" : name + ": " + problem;
}

}  // namespace

std::string SimulatorConfig::Problem() const {
  if (!(setpoint_timeout > 0.0)) return "setpoint_timeout is not above 0 s";
  if (!sensors.empty() && sensors != "raw" && sensors != "truth")
    return "sensors is '" + sensors + "', not raw or truth";
  if (rig.width_px < 8 || rig.height_px < 8) return "rig: the image is below 8 x 8 px";
  if (!(rig.focal_px > 0.0)) return "rig: focal_px is not above 0";
  for (const auto& problem :
       {Named("vehicle", vehicle.Problem()), Named("battery", battery.Problem()),
        Named("attitude_loop", attitude_loop.Problem()), Named("imu", imu.Problem()),
        Named("lidar", lidar.Problem()), Named("camera", camera.Problem()),
        Named("hardware", hardware.Problem())})
    if (!problem.empty()) return problem;
  for (const world::FaultSpec& fault : faults)
    if (fault.at == world::FaultSpec::kDrawn)
      return "faults: " + fault.name + " has no time; give its key at, s";
  return "";
}

Simulator::Simulator(const world::Scenario& scenario, const SimulatorConfig& config)
    : scenario_(scenario),
      config_(config),
      actors_(scenario),
      scene_(scenario, DecoyLead(config.faults)),
      quadrotor_(config.vehicle, StartState(scenario, config.vehicle),
                 [ground = scenario.world.ground](double x, double y) {
                   return world::GroundHeight(ground, x, y);
                 }),
      battery_(config.battery),
      attitude_loop_(config.attitude_loop, config.vehicle.inertia),
      wind_(scenario.wind, static_cast<uint64_t>(config.seed)),
      imu_(config.imu, static_cast<uint64_t>(config.seed)),
      lidar_(config.lidar, config.rig, static_cast<uint64_t>(config.seed)),
      camera_(config.camera, config.rig, scenario.target.color,
              static_cast<uint64_t>(config.seed)) {}

void Simulator::Disturb(const Disturbance& disturbance) {
  gust_ = disturbance.gust;
  quadrotor_.SetMotorShares(disturbance.motors);
  scene_.Show(!disturbance.target_hidden, disturbance.decoy);
}

void Simulator::SetSetpoint(const AttitudeSetpoint& setpoint, double t) {
  if (!(setpoint.orientation.norm() > 0.1)) return;
  setpoint_ = setpoint;
  setpoint_.orientation = estimator_.InWorld(setpoint.orientation);
  setpoint_time_ = t;
}

bool Simulator::SetpointFresh() const { return now() - setpoint_time_ <= config_.setpoint_timeout; }

/// Hover thrust as PX4's estimator learns it, from thrust asked for over acceleration felt: an
/// autopilot knows neither the motors' true thrust nor the true mass.
void Simulator::LearnHoverThrust() {
  const double felt = quadrotor_.thrust() / config_.vehicle.TrueMass();
  if (!SetpointFresh() || !setpoint_.motors || quadrotor_.on_ground() || felt < kGravity / 2)
    return;
  hover_thrust_ += kStep / kHoverMemory * (setpoint_.thrust / felt * kGravity - hover_thrust_);
}

Px4Body Simulator::Known() const {
  Px4Body body = estimator_.Body(quadrotor_.state());
  body.touches = on_ground();
  body.thrust = quadrotor_.thrust() / config_.vehicle.TrueMass();
  body.hover_thrust = hover_thrust_;
  body.charge = battery_.charge();
  return body;
}

/// The setpoint while it is fresh; without one it lands, as with COM_OBL_RC_ACT 4.
AttitudeSetpoint Simulator::ActiveSetpoint() {
  if (SetpointFresh()) {
    own_mode_.reset();
    return setpoint_;
  }
  Px4Body body = Known();
  body.touches = body.touches || steps_ == 0;
  if (!own_mode_ || !own_mode_->Holds(body)) own_mode_.emplace(body);
  AttitudeSetpoint landing = own_mode_->Demand(body, true);
  landing.orientation = estimator_.InWorld(landing.orientation);
  return landing;
}

void Simulator::StepPhysics() {
  wind_.Step(kStep);
  const bool resting = SetpointFresh() ? !setpoint_.motors : quadrotor_.on_ground();
  const Wrench wrench =
      attitude_loop_.Step(ActiveSetpoint(), quadrotor_.state(), quadrotor_.on_ground(), kStep);
  quadrotor_.Step(resting ? Wrench{} : wrench, wind_.velocity() + gust_, kStep);
  quadrotor_.SetSupply(battery_.ThrustShare());
  LearnHoverThrust();
  battery_.Draw(quadrotor_.motor_thrusts().sum() / (config_.vehicle.TrueMass() * kGravity), kStep);
  ++steps_;
}

TimedPose Simulator::Pose() const { return {now(), quadrotor_.state().p, quadrotor_.state().q}; }

/// Steps to t and returns the poses on the way, the first included.
std::vector<TimedPose> Simulator::Fly(double t) {
  std::vector<TimedPose> poses = {Pose()};
  const long last = static_cast<long>(std::floor(t / kStep + 1e-6));
  while (steps_ < last) {
    StepPhysics();
    poses.push_back(Pose());
  }
  return poses;
}

Truth Simulator::TruthNow() const {
  Truth truth;
  truth.mission_time = now() - scenario_.settle_s;
  truth.body = quadrotor_.state();
  truth.target = actors_.Target(truth.mission_time);
  truth.movers = actors_.Movers(truth.mission_time);
  return truth;
}

/// The frame due by now, if any; late frames are not made up for.
std::optional<Image> Simulator::TakeFrame(const Truth& truth) {
  const double rate = config_.camera.rate;
  if (rate <= 0.0 || now() < static_cast<double>(frames_) / rate - 1e-9) return std::nullopt;
  frames_ = static_cast<long>(std::floor(now() * rate + 1e-6)) + 1;
  scene_.MoveTo(truth.mission_time);
  return camera_.Render(truth.body.p, truth.body.q, now(), scene_, truth.target.cylinder);
}

Output Simulator::Advance(double t) {
  const std::vector<TimedPose> poses = Fly(t);
  scene_.MoveTo(0.5 * (poses.front().t + poses.back().t) - scenario_.settle_s);
  lidar_.Advance(poses, scene_);
  Output output;
  output.truth = TruthNow();
  output.image = TakeFrame(output.truth);
  output.truth.view = camera_.View();
  output.imu = imu_.Measure(output.truth.body, now() - last_measurement_);
  last_measurement_ = now();
  output.sweep = lidar_.Take();
  output.packets = lidar_.TakePackets();
  return output;
}

}  // namespace chase::simulator
