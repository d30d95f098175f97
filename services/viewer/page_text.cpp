#include "services/viewer/page_text.h"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

namespace chase::viewer {
namespace {

using nlohmann::json;

constexpr int kPathPoints = 24;  // 0.1 s of a horizon of 2.5 s
constexpr int kFanPoints = 6;

std::string Text(const json& j) {  // text from elsewhere need not be UTF-8
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

json Number(double v) {
  if (!std::isfinite(v)) return nullptr;
  return std::round(v * 1000.0) / 1000.0;
}

template <class V>
json Numbers(const V& v) {
  json out = json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) out.push_back(Number(v[i]));
  return out;
}

/// Quaternions need a digit more: w x y z.
json Rotation(const Eigen::Quaterniond& q) {
  json out = json::array();
  for (const double v : {q.w(), q.x(), q.y(), q.z()})
    out.push_back(std::isfinite(v) ? json(std::round(v * 1e4) / 1e4) : json(nullptr));
  return out;
}

/// x y z of points along the whole path, one after the other.
json Path(const world::Trajectory& path, int points) {
  json out = json::array();
  for (int i = 0; i <= points; ++i) {
    const Eigen::Vector3d p = path.Position(path.start + path.duration * i / points);
    for (const double v : {p.x(), p.y(), p.z()}) out.push_back(Number(v));
  }
  return out;
}

json AgeOf(double age, double most) {
  return {{"age", Number(age)}, {"stale", !world::IsFresh(age, most)}};
}

/// With `age` [s], and whether it is beyond `most`.
json Aged(json part, double age, double most) {
  part.update(AgeOf(age, most));
  return part;
}

json DroneOf(const Drone& d) {
  return {{"p", Numbers(d.p_WB)},
          {"v", Numbers(d.v_WB)},
          {"q", Rotation(d.R_WB)},
          {"health", d.health},
          {"reason", d.reason}};
}

json TargetOf(const Target& t) {
  json out = {{"state", t.state}, {"existence", Number(t.existence)}, {"reason", t.reason}};
  if (!t.Known()) return out;
  const Axes axes = AxesOf(t.covariance);
  out["p"] = Numbers(t.p_WT);
  out["v"] = Numbers(t.v_WT);
  out["radius"] = Number(t.radius);
  out["height"] = Number(t.height);
  out["axes"] = Numbers(axes.half);
  out["q"] = Rotation(axes.R);
  return out;
}

json PlanOf(const Plan& p) {
  json out = {{"verdict", p.verdict},
              {"reason", p.reason},
              {"clearance", Number(p.clearance)},
              {"radius", Number(p.radius)},
              {"path", Path(p.path, kPathPoints)}};
  if (p.stop) out["stop"] = Path(*p.stop, kPathPoints / 2);
  return out;
}

json ForecastOf(const Forecast& f) {
  json spread = json::array();
  for (int i = 0; i <= kFanPoints; ++i)
    spread.push_back(Number(SpreadAt(f, f.path.duration * i / kFanPoints)));
  return {{"verdict", f.verdict}, {"path", Path(f.path, kFanPoints * 4)}, {"spread", spread}};
}

json FlightOf(const Flight& f) {
  return {
      {"state", f.state}, {"reason", f.reason}, {"since", Number(f.since)}, {"missing", f.missing}};
}

json TrackingOf(const Tracking& t) { return {{"following", t.following}}; }

json FenceOf(const Fence& f) {
  json corners = json::array();
  for (const Eigen::Vector2d& p : f.corners) corners.push_back(Numbers(p));
  return {{"corners", corners}, {"floor", Number(f.floor)}, {"ceiling", Number(f.ceiling)}};
}

json TruthOf(const std::vector<Body>& bodies) {
  json rows = json::array();
  for (const Body& b : bodies) rows.push_back({{"p", Numbers(b.p)}, {"q", Rotation(b.R)}});
  return rows;
}

json RowOf(const Sample& s) {
  json row = {Number(s.t),       Number(s.distance), Number(s.clearance), Number(s.speed),
              Number(s.plan_ms), s.verdict,          s.target_state,      s.health};
  for (const Eigen::Vector3d* p : {&s.p_WB, &s.p_WT})
    for (const double v : {p->x(), p->y(), p->z()}) row.push_back(Number(v));
  row.push_back(s.flight);
  row.push_back(s.processes);
  row.push_back(s.faults);
  return row;
}

json PlayOf(const PlayState& p) {
  return {{"t", Number(p.t)},
          {"duration", Number(p.duration)},
          {"speed", Number(p.speed)},
          {"playing", p.playing}};
}

template <class T>
void Append(const T& value, std::string* out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out->append(bytes, sizeof(T));
}

}  // namespace

std::string StateText(const Scene& scene, double t, int generation,
                      const std::optional<PlayState>& play) {
  json out = {{"type", "state"},
              {"generation", generation},
              {"utime", scene.utime},
              {"row", RowOf(SampleOf(scene, t))}};
  const auto add = [&out](const char* name, const auto& part, double most, auto of) {
    if (part) out[name] = Aged(of(*part), part->age, most);
  };
  add("drone", scene.drone, kMostShownAge.pose, DroneOf);
  add("target", scene.target, kMostShownAge.target, TargetOf);
  add("plan", scene.plan, kMostShownAge.plan, PlanOf);
  add("forecast", scene.forecast, kMostShownAge.forecast, ForecastOf);
  add("tracking", scene.tracking, kMostShownAge.tracking, TrackingOf);
  add("flight", scene.flight, kMostShownAge.flight, FlightOf);
  if (scene.obstacles_age) out["obstacles"] = AgeOf(*scene.obstacles_age, kMostShownAge.obstacles);
  if (scene.image_age) out["image"] = AgeOf(*scene.image_age, kMostShownAge.image);
  if (scene.fence) out["fence"] = FenceOf(*scene.fence);
  if (!scene.truth.empty()) out["truth"] = TruthOf(scene.truth);
  if (play) out["play"] = PlayOf(*play);
  return Text(out);
}

std::string ObstaclesText(const std::vector<world::Obstacle>& obstacles, double t, double told,
                          int generation) {
  json rows = json::array();
  for (const world::Obstacle& o : obstacles) {
    const Solid solid = SolidOf(o, t);
    rows.push_back({{"id", o.id},
                    {"kind", o.ground   ? 2
                             : o.moving ? 1
                                        : 0},
                    {"solid", static_cast<int>(o.solid)},
                    {"p", Numbers(solid.center)},
                    {"half", Numbers(solid.half)},
                    {"q", Rotation(solid.R)}});
    if (o.moving) rows.back()["v"] = Numbers(solid.velocity);
  }
  return Text(
      {{"type", "obstacles"}, {"generation", generation}, {"t", Number(told)}, {"rows", rows}});
}

std::string HealthText(const std::vector<ProcessHealth>& processes, const std::string& self) {
  json rows = json::array();
  for (const ProcessHealth& p : processes) {
    json channels = json::array();
    for (const ChannelHealth& c : p.channels)
      channels.push_back({c.channel, Number(c.rate_hz), c.dropped, c.malformed, c.foreign});
    rows.push_back({{"name", p.name},
                    {"state", p.state},
                    {"detail", p.detail},
                    {"error", p.last_error},
                    {"age", Number(p.age)},
                    {"cpu", Number(p.cpu_percent)},
                    {"rss", Number(p.rss_mb)},
                    {"restarts", p.restarts},
                    {"channels", channels}});
  }
  return Text({{"type", "health"}, {"rows", rows}, {"self", self}});
}

std::string HelloText(const std::string& source, double duration, bool commands,
                      const History& history) {
  json rows = json::array();
  for (const Sample& s : history.samples()) rows.push_back(RowOf(s));
  return Text({{"type", "hello"},
               {"source", source},
               {"duration", Number(duration)},
               {"commands", commands},
               {"rows", rows}});
}

std::string ReplyText(const std::string& command, const std::string& refusal,
                      const std::string& words) {
  return Text({{"type", "reply"}, {"command", command}, {"refusal", refusal}, {"words", words}});
}

std::string EncodeImage(double t, int width, int height, const std::optional<Target>& target,
                        const std::string& jpeg) {
  json about = {{"t", Number(t)}, {"width", width}, {"height", height}};
  if (target) {
    about["state"] = target->state;
    about["existence"] = Number(target->existence);
    if (target->box_px.allFinite() && target->box_px[2] > 0.0)
      about["box"] = Numbers(target->box_px);
  }
  const std::string text = Text(about);
  std::string out("\2\0\0\0", 4);
  Append(static_cast<uint32_t>(text.size()), &out);
  return out + text + jpeg;
}

}  // namespace chase::viewer
