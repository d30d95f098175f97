#include "services/mission/mission_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/health_t.hpp"
#include "common/bus/battery.h"
#include "common/bus/command_call.h"
#include "common/bus/convert.h"
#include "common/world/column.h"

namespace chase::mission {

namespace {

constexpr int64_t kHealthTicks = 10;  // 1 Hz, as the statuses that it sums up
constexpr double kNeverHeard = -1.0;  // process_health_t's age

}  // namespace

MissionNode::MissionNode(bus::Bus& bus, const MissionConfig& config)
    : bus_(bus), config_(config), origin_(bus.identity().start), mission_(config, 0.0) {
  bus_.Subscribe<command_t>("COMMAND", [this](const command_t& m) { OnCommand(m); });
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
  bus_.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) { OnObstacles(m); });
  bus_.Subscribe<target_t>("TARGET", [this](const target_t& m) {
    mission_.inputs().target = Seconds(m.utime);
    mission_.inputs().target_tracked =
        m.state == target_t::TRACKING || m.state == target_t::OCCLUDED;
  });
  bus_.Subscribe<prediction_t>("PREDICTION", [this](const prediction_t& m) {
    mission_.inputs().prediction = Seconds(m.utime);
  });
  bus_.Subscribe<plan_t>("PLAN", [this](const plan_t& m) { OnPlan(m); });
  bus_.Subscribe<tracking_t>("TRACKING", [this](const tracking_t& m) { OnTracking(m); });
  bus_.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) {
    mission_.inputs().motors_off = m.motors == attitude_setpoint_t::MOTORS_OFF;
  });
  bus_.Subscribe<flight_state_t>("HOME", [this](const flight_state_t& m) {
    if (!led_before_ && m.since < origin_) led_before_ = m.since;
    mission_.Remember(Now(), {bus::ToVector(m.home), m.epoch},
                      {static_cast<State>(m.state), Seconds(m.since), m.reason});
  });
  bus_.Subscribe<selection_t>("SELECTION", [this](const selection_t& m) { selection_ = m; });
  SubscribeStatuses();
}

void MissionNode::SubscribeStatuses() {
  const auto heard = [this](const status_t& m) { OnStatus(m); };
  bus_.Subscribe<status_t>("LIDAR_STATUS", heard);
  bus_.Subscribe<status_t>("CAMERA_STATUS", heard);
  bus_.Subscribe<status_t>("ODOMETRY_STATUS", heard);
  bus_.Subscribe<status_t>("MAPPING_STATUS", heard);
  bus_.Subscribe<status_t>("PERCEPTION_STATUS", heard);
  bus_.Subscribe<status_t>("PREDICTION_STATUS", heard);
  bus_.Subscribe<status_t>("PLANNING_STATUS", heard);
  bus_.Subscribe<status_t>("CONTROL_STATUS", heard);
  bus_.Subscribe<status_t>("FCU_STATUS", heard);
  bus_.Subscribe<status_t>("SIMULATOR_STATUS", heard);
  bus_.Subscribe<status_t>("RECORDER_STATUS", heard);
  bus_.Subscribe<status_t>("MISSION_STATUS", heard);
  bus_.Subscribe<status_t>("VIEWER_STATUS", heard);
  bus_.Subscribe<status_t>("LINK_STATUS", heard);
}

void MissionNode::OnCommand(const command_t& message) {
  if (message.kind == command_t::SELECT) return;  // perception's
  world::CommandAnswer answer = mission_.Obey(
      Now(),
      {bus::KeyOf(message, origin_), static_cast<Event>(message.kind), bus::IsForced(message)});
  if (answer.unknown)
    answer.reason += fmt::format(", now {}: {}", Name(mission_.state()), mission_.Words());
  bus_.Publish("COMMAND_ACK", bus::Acknowledgement(message, answer, bus_.Now()));
  if (answer.accepted) SendState();
}

void MissionNode::OnPose(const pose_t& message) {
  PoseReport pose;
  pose.t = Seconds(message.utime);
  pose.p = bus::ToVector(message.pos);
  pose.v = bus::ToVector(message.vel);
  pose.epoch = message.epoch;
  pose.healthy = message.health == pose_t::HEALTH_OK;
  pose.usable = pose.healthy || message.health == pose_t::HEALTH_DEGRADED;
  pose.reason = message.reason;
  Inputs& inputs = mission_.inputs();
  if (inputs.pose && inputs.pose->epoch != pose.epoch) inputs.sweeps = {};
  inputs.pose = std::move(pose);
}

// In the air nobody asks for the column.
void MissionNode::OnObstacles(const obstacles_t& message) {
  Inputs& inputs = mission_.inputs();
  if (message.n_cut > 0 || (inputs.pose && inputs.pose->epoch != message.epoch)) return;
  inputs.obstacles = Seconds(message.utime);
  inputs.sweeps.Add(*inputs.obstacles, inputs.pose && inputs.pose->healthy);
  if (IsAirborne(mission_.state()) || !inputs.pose) return;
  std::vector<world::Obstacle> obstacles;
  for (const obstacle_t& o : message.obstacles) obstacles.push_back(bus::FromMessage(o, origin_));
  inputs.blocked =
      world::IsColumnBlocked(obstacles, inputs.pose->p, config_.body_radius, config_.climb_height);
}

void MissionNode::OnPlan(const plan_t& message) {
  Inputs& inputs = mission_.inputs();
  inputs.plan_heard = Now();
  inputs.plan_reason = message.reason;
  const world::Trajectory plan = bus::FromMessage(message.position, origin_);
  inputs.plan_end = plan.Position(plan.end());
  if (!config_.geofence.Exists()) return;
  std::optional<world::Trajectory> stop;
  if (message.stop.n_coefficients > 0) stop = bus::FromMessage(message.stop, origin_);
  inputs.way = world::PlacesOn(plan, stop);
}

void MissionNode::OnTracking(const tracking_t& message) {
  mission_.inputs().flying = message.following != tracking_t::NONE;
  mission_.inputs().landing = message.following == tracking_t::LAND;
}

void MissionNode::OnStatus(const status_t& message) {
  ProcessReport report;
  report.t = Seconds(message.utime);
  report.state = message.state;
  report.failed = message.state == status_t::FAILED;
  report.start = message.sender_start;
  mission_.inputs().Heard(message.name, report);
  autopilot_.Hear(message);
  if (const std::optional<double> battery = bus::BatteryIn(message)) {
    mission_.inputs().battery = battery;
    mission_.inputs().battery_heard = report.t;
  }
}

void MissionNode::Tick(int64_t /*utime*/) {
  Inputs& inputs = mission_.inputs();
  inputs.autopilot = autopilot_.words();
  inputs.handed_over = autopilot_.IsHandedOver();
  inputs.on_ground = autopilot_.IsOnGround();
  inputs.armed = autopilot_.IsArmed();
  inputs.disarmed.reset();
  if (const auto said = autopilot_.disarmed()) inputs.disarmed = Seconds(*said);
  mission_.Update(Now());
  SendState();
  if (ticks_++ % kHealthTicks != 0) return;
  SendHealth();
  SendSelection();
}

void MissionNode::SendState() {
  flight_state_t m{};
  m.utime = bus_.Now();
  m.epoch = mission_.home() ? mission_.home()->epoch : 0;
  m.state = static_cast<int8_t>(mission_.state());
  m.reason = mission_.Words();
  m.since = bus::Utime(mission_.since(), origin_);
  m.has_home = mission_.home() ? 1 : 0;
  if (mission_.home()) bus::Set(m.home, mission_.home()->p);
  m.missing = mission_.missing();
  m.n_missing = static_cast<int32_t>(m.missing.size());
  bus_.Publish("FLIGHT_STATE", m);
  SendGeofence();  // behind it: it counts from the place that is told there
}

void MissionNode::SendHealth() {
  std::map<std::string, process_health_t> rows;
  for (const std::string& name : config_.needs)
    rows[name] = {name, status_t::FAILED, kNeverHeard, 0};
  for (const auto& [name, report] : mission_.inputs().processes)
    rows[name] = {name, report.state, std::max(0.0, Now() - report.t),
                  report.restarts + (CameBackBefore(name, report) ? 1 : 0)};
  health_t m{};
  m.utime = bus_.Now();
  for (const auto& [name, row] : rows) m.processes.push_back(row);
  m.n_processes = static_cast<int32_t>(m.processes.size());
  bus_.Publish("HEALTH", m);
}

/// A mission process before this one led a flight, for which all that it needs was there: what
/// started later had come back when this one heard it first. Once at least.
bool MissionNode::CameBackBefore(const std::string& name, const ProcessReport& report) const {
  const bool was_there = name == "mission" || std::find(config_.needs.begin(), config_.needs.end(),
                                                        name) != config_.needs.end();
  return was_there && led_before_ && report.first > *led_before_;
}

/// A perception process that was started anew knows nothing of it.
void MissionNode::SendSelection() {
  if (!selection_) return;
  selection_t m = *selection_;
  m.utime = bus_.Now();
  bus_.Publish("SELECTION_KEPT", m);
}

/// Where it lies is known from take-off on.
void MissionNode::SendGeofence() {
  const world::Geofence& fence = config_.geofence;
  if (!fence.Exists() || !mission_.home()) return;
  const Eigen::Vector3d& home = mission_.home()->p;
  geofence_t m{};
  m.utime = bus_.Now();
  m.epoch = mission_.home()->epoch;
  for (const Eigen::Vector2d& corner : fence.polygon) {
    m.corners.push_back(home.x() + corner.x());
    m.corners.push_back(home.y() + corner.y());
  }
  m.n_corners = static_cast<int32_t>(m.corners.size());
  m.floor = home.z() + fence.floor;
  m.ceiling = home.z() + fence.ceiling;
  bus_.Publish("GEOFENCE", m);
}

double MissionNode::Now() const { return Seconds(bus_.Now()); }

double MissionNode::Seconds(int64_t utime) const { return bus::Seconds(utime, origin_); }

bus::NodeReport MissionNode::Report() const {
  using Health = bus::NodeReport::State;
  const State state = mission_.state();
  const bool waits = state == State::kIdle || state == State::kReady;
  return {state == State::kEmergency ? Health::kFailed
          : waits                    ? Health::kStarting
                                     : Health::kOk,
          fmt::format("{}: {}", Name(state), mission_.reason())};
}

}  // namespace chase::mission
