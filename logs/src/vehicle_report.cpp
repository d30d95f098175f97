#include "logs/src/vehicle_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/validation.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/flown_plans.h"
#include "logs/src/landing_figures.h"
#include "logs/src/log_survey.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLongestStep = 1.0;  // s that a message may stand for until the next one comes
constexpr double kShown = 0.1;        // s between points of the page
constexpr const char* kHealths[] = {"ok", "degraded", "lost", "starting"};
constexpr const char* kTargets[] = {"searching", "tracking", "occluded", "lost"};

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

double Rounded(double v) { return std::round(v * 1e4) / 1e4; }

/// Seconds under each name, and stretches of time with the same one.
class Lane {
 public:
  void Add(double t, const std::string& name) {
    if (!spans_.empty()) {
      const double step = std::clamp(t - last_, 0.0, kLongestStep);
      seconds_[spans_.back().name] += step;
      spans_.back().to = last_ + step;
    }
    if (spans_.empty() || spans_.back().name != name || t - last_ > kLongestStep)
      spans_.push_back({name, t, t});
    last_ = t;
  }
  const std::map<std::string, double>& seconds() const { return seconds_; }
  void AddTo(const std::string& lane, Json* spans) const {
    for (const Span& s : spans_)
      spans->push_back({{"lane", lane}, {"label", s.name}, {"from", s.from}, {"to", s.to}});
  }

 private:
  struct Span {
    std::string name;
    double from, to;  // s
  };
  std::vector<Span> spans_;
  std::map<std::string, double> seconds_;
  double last_ = 0.0;
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
  void Add(const LogEvent& e) {
    Take<pose_t>(e, "POSE", [this](const pose_t& m) { OnPose(m); });
    Take<target_t>(e, "TARGET", [this](const target_t& m) { OnTarget(m); });
    Take<plan_t>(e, "PLAN", [this](const plan_t& m) { OnPlan(m); });
    Take<tracking_t>(e, "TRACKING", [this](const tracking_t& m) {
      errors_.push_back(bus::ToVector(m.error).norm());
    });
    Take<attitude_setpoint_t>(e, "ATTITUDE_SETPOINT", [](const auto&) {});
    Take<obstacles_t>(e, "OBSTACLES", [](const auto&) {});
    Take<flight_state_t>(e, "FLIGHT_STATE", [this](const flight_state_t& m) { OnState(m); });
    status_t status;
    if (EndsWith(e.channel, "_STATUS") && DecodeBytes(e.bytes, &status) &&
        bus::Problem(status).empty())
      statuses_[status.name] = status;
  }

  VehicleReport Report(const std::string& log, const LogInfo& info) {
    if (poses_ == 0 && plans_ == 0)
      throw std::runtime_error(log +
                               ": holds neither TRUTH nor POSE nor PLAN: no flight to report");
    VehicleReport report;
    report.whole = info.Whole();
    AddFigures(&report.metrics);
    AddStages(&report.metrics);
    for (const ChannelInfo& c : info.channels)
      report.metrics["lost_messages"][c.channel] = c.missing;
    report.metrics["software"] = info.Software();
    report.metrics["losses"] = info.Losses();
    report.metrics["log_whole"] = info.Whole();
    AddSeries(&report.series);
    return report;
  }

 private:
  /// Hands over a good message; what it is old when it is logged is its latency.
  template <class T, class F>
  void Take(const LogEvent& e, const std::string& name, F handle) {
    T m;
    if (!EndsWith(e.channel, name) || !DecodeBytes(e.bytes, &m) || !bus::Problem(m).empty()) return;
    if (origin_ == 0) origin_ = m.utime;
    end_ = std::max(end_, Time(m.utime));
    if (name != "PLAN")  // stamped with its start, which is ahead
      latencies_[name].push_back(1e3 * bus::Seconds(e.utime, m.utime));
    handle(m);
  }
  double Time(int64_t utime) const { return bus::Seconds(utime, origin_); }

  void OnPose(const pose_t& m) {
    const double t = Time(m.utime);
    const Eigen::Vector3d p = bus::ToVector(m.pos);
    health_.Add(t, kHealths[m.health]);
    const bool same = poses_++ > 0 && m.epoch == epoch_;
    if (same) path_ += (p - last_p_).norm();
    if (poses_ > 1 && m.epoch != epoch_) ++frame_changes_;
    epoch_ = m.epoch;
    last_p_ = p;
    speed_ = std::max(speed_, bus::ToVector(m.vel).norm());
    sigma_ = std::max(sigma_,
                      std::sqrt(std::max({m.covariance[0], m.covariance[10], m.covariance[20]})));
    if (t < next_shown_) return;
    next_shown_ = t + kShown;
    chaser_.emplace_back(p.x(), p.y());
  }

  void OnTarget(const target_t& m) {
    target_.Add(Time(m.utime), kTargets[m.state]);
    ++targets_;
    const bool known = m.state == target_t::TRACKING || m.state == target_t::OCCLUDED;
    tracked_ += known;
    if (known && targets_ % 2 == 0) seen_.emplace_back(m.mean[0], m.mean[1]);  // 10 Hz
  }

  void OnPlan(const plan_t& m) {
    ++plans_;
    fallbacks_ += m.verdict > plan_t::WIDER;
    verdict_.Add(Time(m.utime), VerdictName(m.verdict));
    if (m.certified_clearance < 0.0) return;
    ++certified_;
    clearance_.emplace_back(Time(m.utime), m.certified_clearance);
  }

  void OnState(const flight_state_t& m) {
    flight_.Add(Time(m.utime), StateName(m.state));
    if (states_.empty() || states_.back()["state"] != StateName(m.state))
      states_.push_back({{"state", StateName(m.state)}, {"at_s", Time(m.utime)}});
  }

  static Json Share(long part, long all) {
    return all > 0 ? Json(static_cast<double>(part) / static_cast<double>(all)) : Json();
  }

  void AddFigures(Json* m) const {
    Json& j = *m;
    j["truth"] = false;
    j["flown_s"] = end_;
    j["pose_health_s"] = health_.seconds();
    j["frame_changes"] = frame_changes_;
    j["path_m"] = Rounded(path_);
    j["speed_max_mps"] = Rounded(speed_);
    j["pose_sigma_max_m"] = Rounded(sigma_);
    j["target_state_s"] = target_.seconds();
    j["target_known_ratio"] = Share(tracked_, targets_);
    j["replans"] = plans_;
    j["fallbacks"] = fallbacks_;
    j["verdict_s"] = verdict_.seconds();
    j["certified_ratio"] = Share(certified_, plans_);
    const auto least =
        std::min_element(clearance_.begin(), clearance_.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    j["certified_clearance_m"] = least == clearance_.end() ? Json() : Json(least->second);
    j["tracking_error_m"] = Quantiles(errors_);
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

  static Json Points(const std::vector<std::pair<double, double>>& points) {
    Json x = Json::array(), y = Json::array();
    for (const auto& [a, b] : points) {
      x.push_back(Rounded(a));
      y.push_back(Rounded(b));
    }
    return {{"x", x}, {"y", y}};
  }

  void AddSeries(Json* series) const {
    Json& j = *series;
    j["chaser"] = Points(chaser_);
    j["target"] = Points(seen_);
    j["clearance"] = Points(clearance_);
    j["spans"] = Json::array();
    flight_.AddTo("flight", &j["spans"]);
    verdict_.AddTo("verdict", &j["spans"]);
    target_.AddTo("target", &j["spans"]);
    health_.AddTo("pose", &j["spans"]);
  }

  int64_t origin_ = 0;
  double end_ = 0.0, next_shown_ = -1e9;  // s
  Lane health_, target_, verdict_, flight_;
  long poses_ = 0, targets_ = 0, tracked_ = 0, plans_ = 0, fallbacks_ = 0, certified_ = 0;
  int32_t epoch_ = 0;
  long frame_changes_ = 0;
  Eigen::Vector3d last_p_ = Eigen::Vector3d::Zero();
  double path_ = 0.0, speed_ = 0.0, sigma_ = 0.0;
  std::vector<std::pair<double, double>> chaser_, seen_, clearance_;
  std::vector<double> errors_;
  std::map<std::string, std::vector<double>> latencies_;
  std::map<std::string, status_t> statuses_;
  Json states_ = Json::array();
};

}  // namespace

bool HoldsTruth(const std::string& log) {
  LogReader reader(log);
  for (LogEvent e; reader.Next(&e);)
    if (EndsWith(e.channel, "TRUTH")) return true;
  return false;
}

VehicleReport ReportVehicle(const std::string& log) {
  LogReader reader(log);
  Gatherer gatherer;
  LogSurvey survey;
  for (LogEvent e; reader.Next(&e);) {
    gatherer.Add(e);
    survey.Add(e);
  }
  return gatherer.Report(log, survey.Take(reader));
}

}  // namespace chase::logs
