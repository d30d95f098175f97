#include "services/viewer/viewer_node.h"

#include <cmath>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/command_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/map_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/channels.h"
#include "common/bus/convert.h"
#include "common/config/version.h"
#include "common/logs/jpeg.h"
#include "services/viewer/cloud.h"

namespace chase::viewer {
namespace {

constexpr int kTicksPerSecond = 10, kTicksPerObstacles = 5;
constexpr double kWholeLog = 1e9;  // s

ServerConfig ServerConfigOf(const ViewerConfig& config, const std::string& source) {
  ServerConfig out;
  out.address = config.address;
  out.port = config.port;
  out.max_clients = config.max_clients;
  out.parameters = {{"version", config::Version()},
                    {"source", source.empty() ? "live" : source},
                    {"cloud_points", std::to_string(config.cloud_points)},
                    {"max_clients", std::to_string(config.max_clients)}};
  return out;
}

}  // namespace

ViewerNode::ViewerNode(bus::Bus& bus, const ViewerConfig& config, const std::string& source)
    : bus_(bus),
      config_(config),
      source_(source),
      server_(ServerConfigOf(config, source), LoadAssets(AssetFolder())),
      foxglove_(server_),
      commander_(bus, config.token, source.empty(),
                 [this](const auto&... answer) { Answer(answer...); }),
      history_(source.empty() ? config.trail : kWholeLog) {
  SubscribeScene();
  SubscribeMission();
  SubscribeStatuses();
  SubscribeOthers();
}

void ViewerNode::SubscribeScene() {
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
  bus_.Subscribe<target_t>("TARGET", [this](const target_t& m) {
    scene_.target = FromMessage(m);
    foxglove_.Offer("TARGET", m);
  });
  bus_.Subscribe<plan_t>("PLAN", [this](const plan_t& m) {
    Time(m.utime);
    scene_.plan = FromMessage(m, origin_);
    foxglove_.Offer("PLAN", m);
  });
  bus_.Subscribe<prediction_t>("PREDICTION", [this](const prediction_t& m) {
    Time(m.utime);
    scene_.forecast.reset();
    if (m.verdict != prediction_t::NO_TARGET) scene_.forecast = FromMessage(m, origin_);
    foxglove_.Offer("PREDICTION", m);
  });
  bus_.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) {
    Time(m.utime);
    obstacles_ = FromMessage(m, origin_);
    obstacles_sent_ = false;
    foxglove_.Offer("OBSTACLES", m);
  });
  bus_.Subscribe<tracking_t>("TRACKING", [this](const tracking_t& m) {
    scene_.following = Code(m.following);
    foxglove_.Offer("TRACKING", m);
  });
  bus_.Subscribe<scan_registered_t>("SCAN_REGISTERED",
                                    [this](const scan_registered_t& m) { OnScan(m); });
  bus_.Subscribe<camera_image_t>("CAMERA_IMAGE", [this](const camera_image_t& m) { OnImage(m); });
}

void ViewerNode::SubscribeMission() {
  bus_.Subscribe<flight_state_t>("FLIGHT_STATE",
                                 [this](const flight_state_t& m) { OnFlightState(m); });
  bus_.Subscribe<command_ack_t>("COMMAND_ACK", [this](const command_ack_t& m) {
    commander_.Hear(m);
    foxglove_.Offer("COMMAND_ACK", m);
  });
  bus_.Subscribe<health_t>("HEALTH", [this](const health_t& m) {
    mission_health_ = m;
    foxglove_.Offer("HEALTH", m);
  });
}

void ViewerNode::SubscribeStatuses() {
  const auto hear = [this](const status_t& m) { OnStatus(m); };
  bus_.Subscribe<status_t>("LIDAR_STATUS", hear);
  bus_.Subscribe<status_t>("CAMERA_STATUS", hear);
  bus_.Subscribe<status_t>("ODOMETRY_STATUS", hear);
  bus_.Subscribe<status_t>("MAPPING_STATUS", hear);
  bus_.Subscribe<status_t>("PERCEPTION_STATUS", hear);
  bus_.Subscribe<status_t>("PREDICTION_STATUS", hear);
  bus_.Subscribe<status_t>("PLANNING_STATUS", hear);
  bus_.Subscribe<status_t>("CONTROL_STATUS", hear);
  bus_.Subscribe<status_t>("MISSION_STATUS", hear);
  bus_.Subscribe<status_t>("FCU_STATUS", hear);
  bus_.Subscribe<status_t>("SIMULATOR_STATUS", hear);
  bus_.Subscribe<status_t>("RECORDER_STATUS", hear);
}

/// What only Foxglove shows.
void ViewerNode::SubscribeOthers() {
  bus_.Subscribe<imu_t>("IMU", [this](const imu_t& m) { foxglove_.Offer("IMU", m); });
  bus_.Subscribe<lidar_scan_t>("LIDAR_SCAN",
                               [this](const lidar_scan_t& m) { foxglove_.Offer("LIDAR_SCAN", m); });
  bus_.Subscribe<map_t>("MAP", [this](const map_t& m) { foxglove_.Offer("MAP", m); });
  bus_.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) {
    foxglove_.Offer("ATTITUDE_SETPOINT", m);
  });
  bus_.Subscribe<command_t>("COMMAND",
                            [this](const command_t& m) { foxglove_.Offer("COMMAND", m); });
  bus_.Subscribe<scenario_t>("SCENARIO",
                             [this](const scenario_t& m) { foxglove_.Offer("SCENARIO", m); });
}

double ViewerNode::Elapsed(int64_t utime) {
  if (start_ < 0) start_ = utime;
  return bus::Seconds(utime, start_);
}

double ViewerNode::Time(int64_t utime) {
  if (origin_ == 0) origin_ = utime;
  return bus::Seconds(utime, origin_);
}

bool ViewerNode::Due(Part part, int64_t utime, double rate_hz) {
  if (!server_.Wanted(part)) return false;
  int64_t& last = sent_[part];
  // Sweeps and frames come in steps of their own: half a step early counts as due.
  const auto period = static_cast<int64_t>(1e6 / rate_hz) - TickPeriod() / 4;
  if (utime >= last && utime - last < period) return false;
  last = utime;
  return true;
}

void ViewerNode::OnPose(const pose_t& m) {
  Time(newest_ = m.utime);
  if (m.epoch != epoch_ && epoch_ >= 0) {  // what was drawn in the old frame W is nowhere now
    history_.ForgetPositions();
    Forget();
  }
  epoch_ = m.epoch;
  scene_.drone = FromMessage(m);
  pose_heard_ = bus_.Now();
  foxglove_.Offer("POSE", m);
}

void ViewerNode::OnFlightState(const flight_state_t& m) {
  Time(m.utime);
  scene_.flight = FromMessage(m, start_ < 0 ? origin_ : start_);
  flight_heard_ = bus_.Now();
  foxglove_.Offer("FLIGHT_STATE", m);
}

void ViewerNode::OnScan(const scan_registered_t& m) {
  foxglove_.Offer("SCAN_REGISTERED", m);
  if (!Due(Part::kCloud, m.utime, config_.cloud_rate_hz)) return;
  auto timer = bus_.Time("cloud");
  server_.Send(Part::kCloud,
               EncodeCloud(Time(m.utime), bus::ToVector(m.pos), m.x, m.y, m.z,
                           static_cast<size_t>(config_.cloud_points)),
               true);
}

void ViewerNode::OnImage(const camera_image_t& m) {
  foxglove_.Offer("CAMERA_IMAGE", m);
  if (!Due(Part::kImage, m.utime, config_.image_rate_hz)) return;
  auto timer = bus_.Time("image");
  const std::string jpeg = logs::Jpeg(m, config_.jpeg_quality);
  if (jpeg.empty()) return;
  server_.Send(Part::kImage, EncodeImage(Time(m.utime), m.width, m.height, scene_.target, jpeg),
               true);
}

void ViewerNode::OnStatus(const status_t& m) {
  const auto before = statuses_.find(m.name);
  const status_t* last = before == statuses_.end() ? nullptr : &before->second;
  health_[m.name] = FromMessage(m, last);
  status_heard_[m.name] = bus_.Now();
  if (m.name == "planning" && last) scene_.plan_ms = MeanStageMs(m, *last, "plan");
  foxglove_.Offer(bus::StatusChannel(m.name), m);
  statuses_[m.name] = m;
}

void ViewerNode::Remember(int64_t utime) {
  if (origin_ != 0) history_.Add(SampleOf(scene_, Elapsed(utime)));
}

void ViewerNode::Forget() {
  scene_ = Scene();
  obstacles_.clear();
  obstacles_sent_ = false;
  statuses_.clear();
  health_.clear();
  mission_health_.reset();
  sent_.clear();
  epoch_ = -1;
  ++generation_;
}

void ViewerNode::SendHello() {
  server_.Retain(Part::kHello, HelloText(source_, play_ ? play_->duration : 0.0,
                                         !config_.token.empty(), history_));
}

void ViewerNode::SendHealth() {
  const int64_t now = bus_.Now();
  for (auto& [name, health] : health_) health.age = bus::Seconds(now, status_heard_[name]);
  const std::vector<ProcessHealth> rows =
      mission_health_ ? Joined(health_, *mission_health_, now) : Joined(health_, {}, now);
  const Server::Counters c = server_.counters();
  server_.Send(Part::kHealth, HealthText(rows, std::to_string(c.connected) + " connected, " +
                                                   std::to_string(c.refused) + " refused, " +
                                                   std::to_string(c.dropped) + " frames dropped"));
}

void ViewerNode::Answer(const std::string& command, const std::string& refusal,
                        const std::string& words) {
  server_.Send(Part::kReply, ReplyText(command, refusal, words));
}

void ViewerNode::Tick(int64_t utime) {
  for (const Request& request : server_.TakeRequests()) {
    if (!request.command.empty()) commander_.Take(request);
    if (on_play_) on_play_(request);
  }
  commander_.Turn();
  if (scene_.flight) scene_.flight->age = bus::Seconds(bus_.Now(), flight_heard_);
  if (!play_) Remember(utime);
  const bool second = ticks_++ % kTicksPerSecond == 0;
  if (!play_ && second) SendHello();
  if (server_.pages() == 0 || origin_ == 0) return;
  auto timer = bus_.Time("tick");
  if (scene_.drone) scene_.drone->age = bus::Seconds(bus_.Now(), pose_heard_);
  server_.Send(Part::kState, StateText(scene_, Elapsed(utime), generation_, play_));
  if (!obstacles_sent_ && ticks_ % kTicksPerObstacles == 0) {
    obstacles_sent_ = true;
    server_.Send(Part::kObstacles, ObstaclesText(obstacles_, Time(newest_)));
  }
  if (second) SendHealth();
}

bus::NodeReport ViewerNode::Report() const {
  const Server::Counters c = server_.counters();
  return {bus::NodeReport::State::kOk,
          "port " + std::to_string(server_.port()) + ", " + std::to_string(c.connected) +
              " connected, " + std::to_string(c.refused) + " refused, " +
              std::to_string(c.malformed) + " malformed, " + std::to_string(commander_.taken()) +
              " commands taken, " + std::to_string(commander_.refused()) + " refused"};
}

}  // namespace chase::viewer
