#include "services/viewer/messages.h"

#include <algorithm>

#include "common/bus/convert.h"
#include "common/world/ages.h"

namespace chase::viewer {
namespace {

Eigen::Matrix3d RowMajor(const double (&m)[9]) { return bus::ToMatrix(m); }

Body Upright(const double (&p)[3], double yaw) {
  return {bus::ToVector(p), Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

const stage_status_t* StageOf(const status_t& m, const std::string& name) {
  const auto it = std::find_if(m.stages.begin(), m.stages.end(),
                               [&](const stage_status_t& s) { return s.name == name; });
  return it == m.stages.end() ? nullptr : &*it;
}

}  // namespace

Drone FromMessage(const pose_t& m) {
  Drone d;
  d.p_WB = bus::ToVector(m.pos);
  d.v_WB = bus::ToVector(m.vel);
  d.R_WB = bus::ToQuaternion(m.orientation);
  d.health = Code(m.health);
  d.reason = m.reason;
  return d;
}

Target FromMessage(const target_t& m) {
  Target t;
  t.state = Code(m.state);
  t.p_WT = bus::ToVector(m.mean);
  t.v_WT = bus::ToVector(m.velocity);
  t.covariance = RowMajor(m.covariance);
  t.radius = m.radius;
  t.height = m.height;
  t.box_px = Eigen::Vector4d(m.box_px);
  t.existence = m.existence;
  t.reason = m.reason;
  return t;
}

Plan FromMessage(const plan_t& m, int64_t origin) {
  Plan p;
  p.verdict = Code(m.verdict);
  p.reason = m.reason;
  p.path = bus::FromMessage(m.position, origin);
  if (m.stop.n_coefficients > 0) p.stop = bus::FromMessage(m.stop, origin);
  p.clearance = m.certified_clearance;
  p.radius = m.hard_radius;
  return p;
}

Forecast FromMessage(const prediction_t& m, int64_t origin) {
  return {Code(m.verdict), bus::FromMessage(m.target, origin), RowMajor(m.covariance),
          RowMajor(m.velocity_covariance), 0.0};
}

Flight FromMessage(const flight_state_t& m, int64_t origin) {
  return {Code(m.state), m.reason, bus::Seconds(m.since, origin), m.missing, 0.0};
}

Fence FromMessage(const geofence_t& m) {
  Fence fence{{}, m.floor, m.ceiling};
  for (size_t i = 0; i + 1 < m.corners.size(); i += 2)
    fence.corners.emplace_back(m.corners[i], m.corners[i + 1]);
  return fence;
}

std::vector<world::Obstacle> FromMessage(const obstacles_t& m, int64_t origin) {
  std::vector<world::Obstacle> out;
  for (const obstacle_t& o : m.obstacles) out.push_back(bus::FromMessage(o, origin));
  return out;
}

std::vector<Body> FromMessage(const truth_t& m) {
  std::vector<Body> bodies{{bus::ToVector(m.pos), bus::ToQuaternion(m.orientation)},
                           Upright(m.target_pos, m.target_yaw)};
  for (const mover_t& mover : m.movers) bodies.push_back(Upright(mover.pos, mover.yaw));
  return bodies;
}

ProcessHealth FromMessage(const status_t& m, const status_t* before) {
  ProcessHealth p;
  p.name = m.name;
  p.detail = m.detail;
  p.last_error = m.last_error;
  p.state = Code(m.state);
  p.rss_mb = m.rss_mb;
  const double passed = before ? bus::Seconds(m.utime, before->utime) : 0.0;
  p.cpu_percent = passed > 0.0 ? 100.0 * (m.cpu - before->cpu) / passed : -1.0;
  for (const channel_status_t& c : m.channels)
    p.channels.push_back({c.channel, c.rate_hz, c.dropped, c.malformed, c.foreign});
  return p;
}

std::vector<ProcessHealth> Joined(const std::map<std::string, ProcessHealth>& heard,
                                  const health_t& mission, int64_t now) {
  std::map<std::string, ProcessHealth> all = heard;
  for (const process_health_t& p : mission.processes) {
    const auto [row, only_there] = all.try_emplace(p.name);
    row->second.restarts = p.restarts;
    if (!only_there) continue;
    row->second.name = p.name;
    row->second.state = Code(p.state);
    row->second.age = p.age < 0.0 ? p.age : p.age + bus::Seconds(now, mission.utime);
    row->second.cpu_percent = -1.0;
    row->second.detail = p.age < 0.0 ? "never heard" : "heard by the mission process only";
  }
  std::vector<ProcessHealth> rows;
  for (const auto& [name, row] : all) rows.push_back(row);
  return rows;
}

int WorstState(const std::vector<ProcessHealth>& processes) {
  int worst = -1;
  for (const ProcessHealth& p : processes)
    worst = std::max(worst, p.age > world::kMostAge.status ? status_t::FAILED + 0 : p.state);
  return worst;
}

double MeanStageMs(const status_t& m, const status_t& before, const std::string& stage) {
  const stage_status_t* now = StageOf(m, stage);
  const stage_status_t* then = StageOf(before, stage);
  if (!now || !then || now->count <= then->count) return -1.0;
  const double sum = now->mean_ms * static_cast<double>(now->count) -
                     then->mean_ms * static_cast<double>(then->count);
  return std::max(sum, 0.0) / static_cast<double>(now->count - then->count);
}

}  // namespace chase::viewer
