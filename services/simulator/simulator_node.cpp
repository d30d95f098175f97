#include "services/simulator/simulator_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "chase/camera_image_t.hpp"
#include "chase/event_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/status_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/battery.h"
#include "common/bus/convert.h"
#include "common/config/version.h"
#include "common/math/rotation.h"
#include "common/world/ages.h"

namespace chase::simulator {
namespace {

constexpr double kMostBehind = 0.3;      // s behind the host's clock that drivers bear
constexpr int64_t kTruthTicks = 2;       // 100 Hz
constexpr int64_t kScenarioTicks = 200;  // 1 Hz; FCU_STATUS as well

std::string ReadText(const std::string& file) {
  std::ifstream in(file);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    throw std::runtime_error(file + ": scenario cannot be read; check the key 'scenario'");
  return text.str();
}

/// Packets are a true sensor's.
SimulatorConfig WithDevices(SimulatorConfig config) {
  config.lidar.packets = config.lidar.packets || config.hardware.packets();
  return config;
}

}  // namespace

SimulatorNode::SimulatorNode(bus::Bus& bus, const SimulatorConfig& config)
    : bus_(bus),
      config_(WithDevices(config)),
      yaml_(ReadText(config.scenario)),
      scenario_(world::ParseScenario(yaml_, config.scenario)),
      simulator_(scenario_, config_),
      hardware_(config_, bus.Now()),
      faults_(config.faults, config.seed) {
  const std::string& sensors = config.sensors.empty() ? scenario_.sensors.mode : config.sensors;
  if (sensors == "truth") truth_feed_ = std::make_unique<TruthFeed>(bus, scenario_, config.rig);
  if (!config_.hardware.mavlink()) Subscribe();
}

void SimulatorNode::Subscribe() {
  bus_.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT",
                                      [this](const auto& message) { OnSetpoint(message); });
  if (!truth_feed_) bus_.Subscribe<pose_t>("POSE", [this](const auto& m) { OnPose(m); });
}

// As the bridge does: a frame that odometry begins anew by its first pose of whatever health, else
// those that are good, and fresh.
void SimulatorNode::OnPose(const pose_t& message) {
  if (message.health == pose_t::HEALTH_STARTING) return;
  const bool anew = epoch_.Change(message.epoch);
  const bool good = message.health != pose_t::HEALTH_LOST &&
                    bus::Seconds(bus_.Now(), message.utime) <= world::kMostAge.pose;
  if (!anew && !good) return;
  simulator_.estimator().Correct(
      {message.utime, bus::ToVector(message.pos), bus::ToVector(message.vel),
       math::Yaw(bus::ToQuaternion(message.orientation)), message.epoch});
}

void SimulatorNode::OnSetpoint(const attitude_setpoint_t& message) {
  if (!power_on_) return;
  AttitudeSetpoint setpoint;
  setpoint.orientation = bus::ToQuaternion(message.orientation);
  setpoint.body_rate = bus::ToVector(message.body_rate);
  setpoint.thrust = std::max(0.0, message.thrust);
  setpoint.motors = message.motors != attitude_setpoint_t::MOTORS_OFF;
  const int64_t utime = std::min(message.utime, last_tick_);  // none counts as from the future
  simulator_.SetSetpoint(setpoint, bus::Seconds(utime, *power_on_));
}

void SimulatorNode::Tick(int64_t utime) {
  if (!power_on_) power_on_ = utime;
  AdvanceFaults(utime);
  hardware_.Steer(bus_.Now(), bus::Seconds(std::max(last_tick_, *power_on_), *power_on_),
                  &simulator_);
  last_tick_ = utime;
  Output output;
  {
    const auto timer = bus_.Time("step");
    output = simulator_.Advance(bus::Seconds(utime, *power_on_));
  }
  faults_.Strike(config_.imu, &output.imu);
  const BodyState& body = output.truth.body;
  simulator_.estimator().Predict(utime, body, output.imu.accel);
  if (truth_feed_) simulator_.estimator().Correct({utime, body.p, body.v, math::Yaw(body.q), 0});
  PublishSensors(&output, utime);
  if (ticks_ % kTruthTicks == 0) PublishTruth(output.truth, utime);
  const bool due = ticks_ % kScenarioTicks == 0;
  if (due) PublishScenario(utime);
  if ((due || simulator_.lands() != lands_) && !config_.hardware.mavlink()) PublishAutopilot(utime);
  lands_ = simulator_.lands();
  if (truth_feed_) truth_feed_->Publish(output.truth, utime, ticks_);
  ++ticks_;
}

/// On the bus, or to the drivers where a device has one.
void SimulatorNode::PublishSensors(Output* output, int64_t utime) {
  if (!config_.hardware.mavlink()) PublishImu(output->imu, utime);
  hardware_.Tell(utime, bus_.Now(), simulator_, output->imu);
  if (!faults_.LidarSilent()) {
    hardware_.SendPackets(std::move(output->packets), *power_on_, bus_.Now(), faults_.LidarClock());
    if (output->sweep && !config_.hardware.packets()) PublishSweep(std::move(*output->sweep));
  }
  if (!output->image) return;
  faults_.Strike(&*output->image);
  if (config_.hardware.stream())
    hardware_.SendImage(*output->image, utime, bus_.Now());
  else
    PublishImage(std::move(*output->image), utime);
}

bus::NodeReport SimulatorNode::Report() const {
  bus::NodeReport report;
  if (!power_on_) {
    report.state = bus::NodeReport::State::kStarting;
    return report;
  }
  const double t = bus::Seconds(last_tick_, *power_on_) - scenario_.settle_s;
  report.detail = scenario_.name + ", mission time " + std::to_string(std::lround(t)) + " s";
  if (config_.hardware.mavlink()) report.detail += ", PX4 " + hardware_.Words();
  const double behind = bus::Seconds(bus_.Now(), last_tick_);
  if (config_.hardware.any() && behind > kMostBehind) {
    report.state = bus::NodeReport::State::kDegraded;
    report.detail += fmt::format(
        ", {:.1f} s behind: drivers go by the host's clock, and this machine is too slow", behind);
  }
  return report;
}

void SimulatorNode::PublishImu(const ImuSample& sample, int64_t utime) {
  imu_t message{};
  message.utime = utime;
  bus::Set(message.accel, sample.accel);
  bus::Set(message.gyro, sample.gyro);
  bus_.Publish("IMU", message);
}

void SimulatorNode::PublishSweep(Sweep sweep) {
  lidar_scan_t message{};
  message.utime = bus::Utime(sweep.start + faults_.LidarClock(), *power_on_);
  message.size = static_cast<int32_t>(sweep.x.size());
  message.x = std::move(sweep.x);
  message.y = std::move(sweep.y);
  message.z = std::move(sweep.z);
  message.t = std::move(sweep.t);
  message.intensity = std::move(sweep.intensity);
  message.ring = std::move(sweep.ring);
  bus_.Publish("LIDAR_SCAN", std::move(message));
}

void SimulatorNode::PublishImage(Image image, int64_t utime) {
  camera_image_t message{};
  message.utime = utime;
  message.width = image.width;
  message.height = image.height;
  message.row_stride = 3 * image.width;
  message.pixelformat = camera_image_t::PIXEL_FORMAT_RGB;
  message.exposure = image.exposure;
  message.size = static_cast<int32_t>(image.rgb.size());
  message.data = std::move(image.rgb);
  bus_.Publish("CAMERA_IMAGE", std::move(message));
}

void SimulatorNode::PublishTruth(const Truth& truth, int64_t utime) {
  truth_t message{};
  message.utime = utime;
  message.mission_time = truth.mission_time;
  bus::Set(message.pos, truth.body.p);
  bus::Set(message.vel, truth.body.v);
  bus::Set(message.accel, truth.body.a);
  bus::Set(message.orientation, truth.body.q);
  bus::Set(message.rotation_rate, truth.body.w);
  bus::Set(message.target_pos, truth.target.center);
  bus::Set(message.target_vel, truth.target.velocity);
  message.target_yaw = truth.target.yaw;
  message.target_px[0] = truth.view.px.x();
  message.target_px[1] = truth.view.px.y();
  message.target_in_image = truth.view.in_image ? 1 : 0;
  message.visible_share = truth.view.visible_share;
  message.n_movers = static_cast<int32_t>(truth.movers.size());
  for (const auto& mover : truth.movers) {
    mover_t& entry = message.movers.emplace_back();
    bus::Set(entry.pos, mover.solid.center);
    bus::Set(entry.vel, mover.velocity);
    entry.yaw = mover.solid.yaw;
  }
  bus_.Publish("TRUTH", message);
}

void SimulatorNode::PublishScenario(int64_t utime) {
  scenario_t message{};
  message.utime = utime;
  message.seed = config_.seed;
  message.start_utime = bus::Utime(scenario_.settle_s, *power_on_);
  message.name = scenario_.name;
  message.yaml = yaml_;
  bus_.Publish("SCENARIO", message);
}

// What the bridge to an autopilot would say of it.
void SimulatorNode::PublishAutopilot(int64_t utime) {
  status_t message{};
  message.utime = utime;
  message.name = "fcu";
  message.state = status_t::OK;
  message.detail = simulator_.lands() ? "landing: no setpoints; " : "";
  message.detail += "simulated, " + bus::BatteryWords(simulator_.charge());
  message.version = config::Version();
  bus_.Publish("FCU_STATUS", message);
}

void SimulatorNode::AdvanceFaults(int64_t utime) {
  const double mission_time = bus::Seconds(utime, *power_on_) - scenario_.settle_s;
  for (const SensorFaults::Change& change : faults_.Advance(mission_time)) {
    event_t message{};
    message.utime = utime;
    message.name = change.name;
    message.phase = change.begins ? event_t::BEGINS : event_t::ENDS;
    bus_.Publish("FAULT", message);
    simulator_.Disturb(faults_.Disturbed());
  }
}

}  // namespace chase::simulator
