#include "logs/src/vehicle_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/tracking_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/convert.h"
#include "common/world/ages.h"
#include "logs/src/flown_plans.h"
#include "logs/src/good_message.h"
#include "logs/src/landing_figures.h"
#include "logs/src/lane.h"
#include "logs/src/log_survey.h"
#include "logs/src/outlines.h"
#include "logs/src/read_flight.h"
#include "logs/src/round_numbers.h"
#include "logs/src/sweep_latency.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kShown = 0.1;   // s between points of the page
constexpr double kRarest = 2.0;  // s: what is sent once a second comes within that
constexpr const char* kHealths[] = {"ok", "degraded", "lost", "starting"};
constexpr const char* kTargets[] = {"searching", "tracking", "occluded", "lost"};

double Rounded(double v) { return std::round(v * 1e4) / 1e4; }

/// Values over time, thinned to what an eye can see; null where there is none for `longest` s.
class Series {
 public:
  explicit Series(double longest = 0.5) : longest_(longest) {}
  void Add(double t, double value) {
    if (!t_.empty() && t > last_ + longest_) {
      t_.push_back(Rounded(last_));
      value_.push_back(NAN);
    }
    last_ = t;
    if (t < next_ && t > next_ - kLongestGap) return;
    next_ = t + kShown;
    t_.push_back(Rounded(t));
    value_.push_back(Rounded(value));
  }
  Json ToJson() const { return {{"t", t_}, {"value", value_}}; }
  bool empty() const { return t_.empty(); }

 private:
  static constexpr double kLongestGap = 10.0;  // s: farther back it is another time
  double longest_, next_ = -1e9, last_ = -1e9;
  std::vector<double> t_, value_;
};

Json Quantiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  double sum = 0.0;
  for (const double v : values) sum += v;
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {{"mean", Rounded(sum / static_cast<double>(values.size()))},
          {"p50", Rounded(at(0.5))},
          {"p99", Rounded(at(0.99))},
          {"max", Rounded(values.back())}};
}

class Gatherer {
 public:
  /// `clock`: of the events, which it takes first.
  Gatherer(const LogClock& clock, std::optional<int64_t> origin) : clock_(clock), origin_(origin) {}

  void Add(const LogEvent& e) {
    heard_ = clock_.now();
    if (first_event_ == 0) first_event_ = heard_;
    last_event_ = std::max(last_event_, heard_);
    if (follows_ || !IsOn(e, "LIDAR_SCAN")) sweeps_.Add(last_event_, e);
    Take<pose_t>(e, "POSE", [this](const pose_t& m) { OnPose(m); });
    Take<target_t>(e, "TARGET", [this](const target_t& m) { OnTarget(m); });
    Take<plan_t>(e, "PLAN", [this](const plan_t& m) { OnPlan(m); });
    Take<tracking_t>(e, "TRACKING", [this](const tracking_t& m) { OnTracking(m); });
    Take<attitude_setpoint_t>(e, "ATTITUDE_SETPOINT", [](const auto&) {});
    Take<obstacles_t>(e, "OBSTACLES", [this](const obstacles_t& m) { obstacles_ = m; });
    Take<flight_state_t>(e, "FLIGHT_STATE", [this](const flight_state_t& m) { OnState(m); });
    Take<geofence_t>(e, "GEOFENCE", [this](const geofence_t& m) { fence_ = m.corners; });
    if (prediction_t m;
        origin_ && Good(e, "PREDICTION", &m) && m.verdict != prediction_t::NO_TARGET)
      predictions_.Add(Time(m.utime), bus::FromMessage(m.target, Origin(m.utime)));
    status_t status;
    if (!Good(e, "_STATUS", &status)) return;
    statuses_[status.name] = status;
    if (!status.vehicle.empty()) vehicles_.insert(status.vehicle);
  }

  VehicleReport Report(const LogInfo& info) const {
    VehicleReport report;
    report.flew = poses_ > 0 || plans_ > 0;
    report.tells_states = !states_.empty();
    report.whole = info.Whole();
    report.begins_in = InAir(first_state_);
    report.ends_in = InAir(state_);
    report.origin = origin_.value_or(0);
    report.log_begin = log_begin_;
    if (const std::string utc = info.Utc(); !utc.empty()) report.metrics["recorded_utc"] = utc;
    AddFigures(&report.metrics);
    AddStages(&report.metrics);
    for (const ChannelInfo& c : info.channels) {
      report.metrics["lost_messages"][c.channel] = c.missing;
      report.metrics["longest_gap_s"][c.channel] = 1e-6 * static_cast<double>(c.longest_gap);
      report.metrics["gap_begins_s"][c.channel] = 1e-6 * static_cast<double>(c.gap_begins);
    }
    report.metrics["software"] = Json(info.SoftwareByKind());
    report.metrics["losses"] = info.Losses();
    report.metrics["log_whole"] = info.Whole();
    RoundNumbers(&report.metrics);
    AddSeries(&report.series);
    return report;
  }

 private:
  /// Hands over a good message; what it is old when it is logged is its latency.
  template <class T, class F>
  void Take(const LogEvent& e, const std::string& name, F handle) {
    T m;
    if (!Good(e, name, &m)) return;
    if (!origin_) origin_ = m.utime;
    if (latencies_.empty()) log_begin_ = Time(m.utime) - bus::Seconds(heard_, first_event_);
    end_ = std::max(end_, Time(m.utime));
    if (name != "PLAN") {  // stamped with its start, which is ahead
      latencies_[name].push_back(1e3 * (bus::Seconds(heard_, *origin_) - Time(m.utime)));
      latency_series_.try_emplace(name, kRarest)
          .first->second.Add(Time(m.utime), latencies_[name].back());
    }
    handle(m);
  }
  double Time(int64_t utime) const { return bus::Seconds(utime, Origin(utime)); }
  /// Of stamps like that one.
  int64_t Origin(int64_t utime) const { return *origin_ + clock_.SetBy(utime); }

  void OnPose(const pose_t& m) {
    const double t = Time(m.utime);
    const Eigen::Vector3d p = bus::ToVector(m.pos);
    health_.Add(t, kHealths[m.health], m.reason);
    const bool same = poses_++ > 0 && m.epoch == epoch_;
    if (same) path_ += (p - last_p_).norm();
    if (poses_ > 1 && !same) {
      ++frame_changes_;
      chaser_.push_back(kBreak);
      next_shown_ = t;
    }
    epoch_ = m.epoch;
    last_p_ = p;
    last_pose_ = t;
    const double speed = bus::ToVector(m.vel).norm();
    const double sigma =
        std::sqrt(std::max({m.covariance[0], m.covariance[10], m.covariance[20], 0.0}));
    speed_ = std::max(speed_, speed);
    sigma_ = std::max(sigma_, sigma);
    speeds_.Add(t, speed);
    sigmas_.Add(t, sigma);
    if (t < next_shown_) return;
    next_shown_ = t + kShown;
    chaser_.emplace_back(p.x(), p.y());
  }

  void OnTarget(const target_t& m) {
    target_.Add(Time(m.utime), kTargets[m.state], m.reason);
    ++targets_;
    const bool known = m.state == target_t::TRACKING || m.state == target_t::OCCLUDED;
    tracked_ += known;
    if (!known) return;
    if (!seen_.empty() && m.epoch != seen_epoch_) seen_.push_back(kBreak);
    seen_epoch_ = m.epoch;
    if (targets_ % 2 == 0) seen_.emplace_back(m.mean[0], m.mean[1]);  // 10 Hz
    if (poses_ > 0 && m.epoch == epoch_ && Time(m.utime) - last_pose_ <= world::kMostAge.pose)
      distances_.Add(Time(m.utime), (bus::ToVector(m.mean) - last_p_).norm());
    const auto variances = {m.covariance[0], m.covariance[4], m.covariance[8], 0.0};
    target_sigmas_.Add(Time(m.utime), std::sqrt(std::max(variances)));
  }

  void OnTracking(const tracking_t& m) {
    follows_ = m.following == tracking_t::PLAN || m.following == tracking_t::STOP;
    errors_.push_back(bus::ToVector(m.error).norm());
    error_series_.Add(Time(m.utime), errors_.back());
  }

  void OnPlan(const plan_t& m) {
    ++plans_;
    if (m.verdict == plan_t::WAIT && waits_ + 1 == plans_)
      ++waits_;
    else
      fallbacks_ += m.verdict > plan_t::WIDER;
    verdict_.Add(Time(m.utime), VerdictName(m.verdict), m.reason);
    paths_.Add(Time(m.utime), bus::FromMessage(m.position, Origin(m.utime)));
    if (m.certified_clearance < 0.0) return;
    ++certified_;
    least_clearance_ = std::min(least_clearance_.value_or(1e9), m.certified_clearance);
    clearances_.Add(Time(m.utime), m.certified_clearance);
  }

  void OnState(const flight_state_t& m) {
    flight_.Add(Time(m.utime), StateName(m.state), m.reason);
    if (states_.empty()) first_state_ = m.state;
    state_ = m.state;
    if (states_.empty() || states_.back()["state"] != StateName(m.state))
      states_.push_back(
          {{"state", StateName(m.state)}, {"at_s", Time(m.utime)}, {"reason", m.reason}});
  }

  static std::string InAir(int8_t state) {
    const bool stands = state == flight_state_t::IDLE || state == flight_state_t::READY ||
                        state == flight_state_t::DONE;
    return stands ? "" : StateName(state);
  }

  static Json Share(long part, long all) {
    return all > 0 ? Json(static_cast<double>(part) / static_cast<double>(all)) : Json();
  }

  Json SweepsToSetpoints() const {
    std::vector<double> ms;
    for (const auto& [heard, latency] : sweeps_.samples())
      ms.push_back(1e-3 * static_cast<double>(latency));
    return Quantiles(ms);
  }

  void AddFigures(Json* m) const {
    Json& j = *m;
    j["truth"] = false;
    j["flown_s"] = end_;
    j["pose_health_s"] = health_.seconds();
    const auto if_any = [](long messages, auto value) {
      return messages > 0 ? Json(value) : Json();
    };
    j["frame_changes"] = if_any(poses_, frame_changes_);
    j["path_m"] = if_any(poses_, Rounded(path_));
    j["speed_max_mps"] = if_any(poses_, Rounded(speed_));
    j["pose_sigma_max_m"] = if_any(poses_, Rounded(sigma_));
    j["target_state_s"] = target_.seconds();
    j["target_known_ratio"] = Share(tracked_, targets_);
    j["replans"] = if_any(plans_, plans_);
    j["fallbacks"] = if_any(plans_, waits_ == plans_ ? waits_ : fallbacks_);
    j["verdict_s"] = verdict_.seconds();
    j["certified_ratio"] = Share(certified_, plans_);
    j["certified_clearance_m"] = least_clearance_ ? Json(*least_clearance_) : Json();
    j["tracking_error_m"] = Quantiles(errors_);
    j["sweep_to_setpoint_ms"] = SweepsToSetpoints();
    if (!vehicles_.empty()) j["vehicles"] = vehicles_;
    for (const auto& [channel, latencies] : latencies_)
      j["latency_ms"][channel] = Quantiles(latencies);
    if (!states_.empty()) j["flight_states"] = states_;
  }

  void AddStages(Json* m) const {
    for (const auto& [name, status] : statuses_) {
      if (status.cpu > 0.0) (*m)["cpu_s"][name] = status.cpu;
      for (const stage_status_t& s : status.stages)
        (*m)["stages_ms"][name + " " + s.name] = {
            {"mean", s.mean_ms}, {"p50", s.p50_ms}, {"p99", s.p99_ms}, {"max", s.max_ms}};
    }
  }

  void AddSeries(Json* series) const {
    Json& j = *series;
    j["chaser"] = Points(chaser_, false);
    j["target"] = Points(seen_, false);
    j["perceived"] = Points(Shadows(PerceivedIn(obstacles_)), true);
    j["predictions"] = Points(predictions_.outlines(), false);
    j["plans"] = Points(paths_.outlines(), false);
    for (const auto& [name, values] : {std::pair("distance", &distances_),
                                       {"certified", &clearances_},
                                       {"speed", &speeds_},
                                       {"tracking_error", &error_series_},
                                       {"pose_sigma", &sigmas_},
                                       {"target_sigma", &target_sigmas_}})
      if (!values->empty()) j[name] = values->ToJson();
    for (const auto& [channel, values] : latency_series_) j["latency"][channel] = values.ToJson();
    for (size_t i = 0; i + 1 < fence_.size(); i += 2) {
      j["geofence"]["x"].push_back(Rounded(fence_[i]));
      j["geofence"]["y"].push_back(Rounded(fence_[i + 1]));
    }
    j["spans"] = Json::array();
    flight_.AddTo("flight", &j["spans"]);
    verdict_.AddTo("verdict", &j["spans"]);
    target_.AddTo("target", &j["spans"]);
    health_.AddTo("pose", &j["spans"]);
  }

  const LogClock& clock_;
  std::optional<int64_t> origin_;
  int64_t first_event_ = 0, last_event_ = 0, heard_ = 0;  // by the log's stamps, settled, us
  SweepLatency sweeps_;  // of those while control follows a plan or its stop
  bool follows_ = false;
  std::set<std::string> vehicles_;
  double log_begin_ = 0.0, end_ = 0.0, next_shown_ = -1e9;  // s
  Lane health_, target_, verdict_, flight_{true};
  long poses_ = 0, targets_ = 0, tracked_ = 0, plans_ = 0, fallbacks_ = 0, certified_ = 0;
  long waits_ = 0;  // plans before the first of another verdict
  int32_t epoch_ = 0, seen_epoch_ = 0;
  double last_pose_ = 0.0;  // s
  long frame_changes_ = 0;
  Eigen::Vector3d last_p_ = Eigen::Vector3d::Zero();
  double path_ = 0.0, speed_ = 0.0, sigma_ = 0.0;
  Outline chaser_, seen_;
  Fan predictions_, paths_;  // of the target; of the plans
  obstacles_t obstacles_{};  // the last
  std::optional<double> least_clearance_;
  Series distances_, clearances_, speeds_, sigmas_, target_sigmas_, error_series_;
  std::map<std::string, Series> latency_series_;
  std::vector<double> errors_, fence_;
  std::map<std::string, std::vector<double>> latencies_;
  std::map<std::string, status_t> statuses_;
  int8_t first_state_ = flight_state_t::IDLE, state_ = flight_state_t::IDLE;
  Json states_ = Json::array();
};

}  // namespace

std::string LacksOfTruth(const std::string& log) {
  LogReader reader(log);
  bool truth = false, scenario = false;
  truth_t sample;
  scenario_t flown;
  for (LogEvent e; !(truth && scenario) && reader.Next(&e);) {
    truth = truth || Good(e, "TRUTH", &sample);
    scenario = scenario || Good(e, "SCENARIO", &flown);
  }
  return truth ? (scenario ? "" : "SCENARIO") : scenario ? "TRUTH" : "TRUTH and no SCENARIO";
}

VehicleReport ReportVehicle(const std::string& log, std::optional<int64_t> origin) {
  LogReader reader(log);
  LogSurvey survey;
  Gatherer gatherer(survey.clock(), origin);
  for (LogEvent e; reader.Next(&e);) {
    survey.Add(e);
    gatherer.Add(e);
  }
  const LogInfo info = survey.Take(reader);
  info.RequireOneVehicle();
  return gatherer.Report(info);
}

}  // namespace chase::logs
