#include "logs/src/report_data.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "logs/src/flown_plans.h"

namespace chase::logs {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;
using Json = nlohmann::ordered_json;

constexpr double kPathStep = 0.1;     // s
constexpr double kSeriesStep = 0.05;  // s
constexpr double kMoverStep = 5.0;    // s from outline to outline

Outline Footprint(const Solid& s) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(s.yaw).toRotationMatrix();
  const Vector2d c = s.center.head<2>(), h = s.half_size.head<2>();
  if (s.kind != Solid::Kind::kBox) return Ellipse(c, turn * h.asDiagonal());
  Outline out;
  for (const Vector2d& corner :
       {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)})
    out.push_back(c + turn * corner.cwiseProduct(h));
  return out;
}

void AddWorld(const FlightRecord& record, ReportData* data) {
  double highest = 0.0;
  for (const TruthSample& s : record.truth) highest = std::max(highest, s.p.z());
  for (const Solid& s : world::StaticSolids(record.scenario)) {
    const bool above = s.center.z() - s.half_size.z() > highest;
    (above ? data->crowns : data->solids).push_back(Footprint(s));
  }
  for (const auto& mover : record.scenario.movers)
    for (double t = 0.0; t <= record.scenario.duration_s; t += kMoverStep)
      data->movers.push_back(Footprint(world::MoverAt(mover, t).solid));
  data->perceived = Shadows(record.obstacles);
}

void AddPaths(const FlightRecord& record, ReportData* data) {
  Thinner truth(kPathStep), pose(kPathStep);
  Fan predictions, plans;
  for (const TruthSample& s : record.truth) {
    if (!record.InMission(s.t) || !truth.Pass(s.t)) continue;
    data->chaser.push_back(s.p.head<2>());
    data->target.push_back(s.target.head<2>());
  }
  std::optional<int32_t> epoch;
  for (const PoseSample& s : record.poses) {
    if (!record.InMission(s.t) || !pose.Pass(s.t)) continue;
    if (epoch && *epoch != s.epoch) data->estimated.push_back(kBreak);
    epoch = s.epoch;
    data->estimated.push_back(s.p.head<2>());
  }
  for (const PredictionSample& s : record.predictions)
    if (s.usable && record.InMission(s.t)) predictions.Add(s.t, s.target);
  for (const PlanSample& s : record.plans)
    if (record.InMission(s.t)) plans.Add(s.t, s.position);
  data->predictions = predictions.outlines();
  data->plans = plans.outlines();
}

void Add(double t, double value, ReportData::Series* series) {
  series->t.push_back(t);
  series->value.push_back(value);
}

void AddSeries(const FlightRecord& record, const std::vector<SampleScore>& scores,
               ReportData* data) {
  Thinner score(kSeriesStep), truth(kSeriesStep);
  for (const SampleScore& s : scores) {
    if (!score.Pass(s.t)) continue;
    Add(s.t, s.distance, &data->distance);
    Add(s.t, s.clearance, &data->clearance);
    Add(s.t, s.visible ? 1.0 : 0.0, &data->visible);
  }
  for (const TruthSample& s : record.truth) {
    if (!record.InMission(s.t) || !truth.Pass(s.t)) continue;
    Add(s.t, s.visible_share, &data->visible_share);
    if (!s.target_in_image) continue;
    Add(s.t, s.target_px.x(), &data->pixel_u);
    Add(s.t, s.target_px.y(), &data->pixel_v);
  }
}

void AddCertified(const FlightRecord& record, const std::vector<SampleScore>& scores,
                  ReportData* data) {
  Thinner score(kSeriesStep);
  FlownPlans flown(record);
  for (const SampleScore& s : scores) {
    const PlanSample* plan = flown.At(s.t);
    const bool certifies = plan && plan->certified_clearance >= 0.0;
    if (certifies && score.Pass(s.t)) Add(s.t, plan->certified_clearance, &data->certified);
  }
}

void AddFaults(const FlightRecord& record, ReportData* data) {
  const double last = record.truth.empty() ? 0.0 : record.truth.back().t;
  for (const FaultSample& s : record.faults)
    data->spans.push_back({"fault", s.name, s.t, std::max(s.t, s.end.value_or(last))});
}

void SlowestFirst(std::vector<StageFigures>* stages) {
  std::stable_sort(stages->begin(), stages->end(),
                   [](const auto& a, const auto& b) { return a.mean_ms > b.mean_ms; });
}

void AddCosts(const FlightRecord& record, ReportData* data) {
  data->stages = record.stages;
  SlowestFirst(&data->stages);
  if (record.truth.empty()) return;
  const double flown = record.truth.back().t - record.truth.front().t;
  for (const auto& [process, cpu] : record.cpu_s)
    if (flown > 0.0) data->cpu_share.push_back({process, 100.0 * cpu / flown});
}

ReportData::Series SeriesIn(const Json& j, const char* key) {
  if (!j.contains(key)) return {};
  return {j[key]["t"], j[key]["value"]};
}

Outline OutlineIn(const Json& points) {
  Outline out;
  for (size_t i = 0; i < points["x"].size(); ++i) out.emplace_back(points["x"][i], points["y"][i]);
  return out;
}

std::vector<Outline> OutlinesIn(const Json& list) {
  std::vector<Outline> out;
  for (const Json& points : list) out.push_back(OutlineIn(points));
  return out;
}

void AddCosts(const Json& metrics, ReportData* data) {
  const Json stages = metrics.value("stages_ms", Json::object());
  for (const auto& [name, ms] : stages.items()) {
    const size_t space = name.find(' ');
    data->stages.push_back({name.substr(0, space), name.substr(space + 1), 0, ms["mean"], ms["p50"],
                            ms["p99"], ms["max"]});
  }
  const Json spent = metrics.value("cpu_s", Json::object());
  const double flown = metrics["flown_s"];
  for (const auto& [process, cpu] : spent.items())
    if (flown > 0.0) data->cpu_share.push_back({process, 100.0 * cpu.get<double>() / flown});
  SlowestFirst(&data->stages);
}

Json ToJson(const ReportData::Series& s) {
  auto t = Json::array(), value = t;
  for (const double v : s.t) t.push_back(std::round(v * 1e3) / 1e3);
  for (const double v : s.value) value.push_back(std::round(v * 1e4) / 1e4);
  return {{"t", t}, {"value", value}};
}

/// 1 where the line of sight is blocked.
Json Blocked(ReportData::Series visible) {
  for (double& v : visible.value) v = 1.0 - v;
  return ToJson(visible);
}

}  // namespace

ReportData PrepareReport(const FlightRecord& record, const std::vector<SampleScore>& scores) {
  ReportData data;
  data.title = record.scenario.name + ", seed " + std::to_string(record.seed);
  data.desired_distance = record.scenario.chaser.desired_distance;
  AddWorld(record, &data);
  AddPaths(record, &data);
  AddSeries(record, scores, &data);
  AddCertified(record, scores, &data);
  AddFaults(record, &data);
  AddCosts(record, &data);
  return data;
}

ReportData PrepareReport(const VehicleReport& vehicle) {
  const Json& said = vehicle.series;
  ReportData data;
  data.truth = false;
  data.title = "Flight without truth";
  data.perceived = OutlinesIn(said["perceived"]);
  data.chaser = OutlineIn(said["chaser"]);
  data.target = OutlineIn(said["target"]);
  data.predictions = OutlinesIn(said["predictions"]);
  if (said.contains("geofence")) data.geofence = OutlineIn(said["geofence"]);
  data.distance = SeriesIn(said, "distance");
  data.certified = SeriesIn(said, "certified");
  data.pose_sigma = SeriesIn(said, "pose_sigma");
  data.target_sigma = SeriesIn(said, "target_sigma");
  data.tracking_error = SeriesIn(said, "tracking_error");
  if (said.contains("latency"))
    for (const auto& [channel, series] : said["latency"].items())
      data.latency[channel] = {series["t"], series["value"]};
  for (const Json& s : said["spans"])
    data.spans.push_back({s["lane"], s["label"], s["from"], s["to"]});
  AddCosts(vehicle.metrics, &data);
  return data;
}

Json ToJson(const ReportData& d) {
  Json j;
  j["title"] = d.title;
  j["desired_distance"] = d.desired_distance;
  j["image_px"] = {d.width_px, d.height_px};
  j["solids"] = Points(d.solids, true);
  j["crowns"] = Points(d.crowns, true);
  j["movers"] = Points(d.movers, true);
  j["perceived"] = Points(d.perceived, true);
  j["chaser"] = Points(d.chaser, false);
  j["target"] = Points(d.target, false);
  j["estimated"] = Points(d.estimated, false);
  j["predictions"] = Points(d.predictions, false);
  j["plans"] = Points(d.plans, false);
  j["distance"] = ToJson(d.distance);
  j["clearance"] = ToJson(d.clearance);
  j["certified"] = ToJson(d.certified);
  j["spans"] = Json::array();
  for (const ReportData::Span& s : d.spans)
    j["spans"].push_back({{"lane", s.lane}, {"label", s.label}, {"from", s.from}, {"to", s.to}});
  j["blocked"] = Blocked(d.visible);
  j["visible_share"] = ToJson(d.visible_share);
  j["pixel_u"] = ToJson(d.pixel_u);
  j["pixel_v"] = ToJson(d.pixel_v);
  j["stages"] = Json::array();
  for (const StageFigures& s : d.stages)
    j["stages"].push_back({{"name", s.process + " " + s.stage},
                           {"count", s.count},
                           {"mean", s.mean_ms},
                           {"p99", s.p99_ms},
                           {"max", s.max_ms}});
  j["cpu"] = Json::array();
  for (const NamedValue& c : d.cpu_share)
    j["cpu"].push_back({{"name", c.name}, {"share", c.value}});
  return j;
}

}  // namespace chase::logs
