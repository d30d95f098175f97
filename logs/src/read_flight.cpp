#include "logs/src/read_flight.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/event_t.hpp"
#include "chase/flight_state_t.hpp"
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
#include "common/math/rotation.h"
#include "logs/src/good_message.h"
#include "logs/src/landing_watch.h"
#include "logs/src/log_survey.h"
#include "logs/src/sweep_latency.h"

namespace chase::logs {
namespace {

double Yaw(const double (&q)[4]) {
  return std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
}

/// Gathers messages as they are; times are settled at the end, when the mission's start is known.
class Gatherer {
 public:
  /// `clock`: of the events, which it takes first.
  explicit Gatherer(const LogClock& clock) : clock_(clock) {}

  void Add(const LogEvent& e) {
    if (Take(e, "TRUTH", &truth_)) {
      if (!first_event_) first_event_ = clock_.now();
      last_event_ = clock_.now();
    }
    Hear(e, "POSE", &poses_);
    Hear(e, "TARGET", &targets_);
    Hear(e, "PREDICTION", &predictions_);
    if (Take(e, "PLAN", &plans_)) plans_heard_.push_back(Heard());
    Take(e, "FAULT", &faults_);
    Hear(e, "FLIGHT_STATE", &states_);
    if (Take(e, "TRACKING", &tracking_)) tracking_heard_.push_back(Heard());
    for (const char* list : {"OBSTACLES", "UNSEEN"})
      if (obstacles_t message; Good(e, list, &message))
        heard_[list].emplace_back(Heard(), clock_.Settled(message.utime));
    AddSetpoint(e);
    sweeps_.Add(Heard(), e);
    TakeLast(e, "SCENARIO", &scenario_);
    TakeLast(e, "OBSTACLES", &obstacles_);
    status_t status;
    if (!Good(e, "_STATUS", &status)) return;
    statuses_[status.name] = status;
    if (status.rss_mb > 0.0) memory_[status.name].push_back({status.uptime, status.rss_mb});
    Settle(&status);
    if (status.name == "fcu") autopilot_.push_back(status);
  }

  FlightRecord Record(const std::string& log) {
    if (truth_.empty())
      throw std::runtime_error(log + ": holds no TRUTH; only a simulated flight can be reported");
    if (!scenario_)
      throw std::runtime_error(log + ": holds no SCENARIO; record the flight from its beginning");
    FlightRecord record;
    record.scenario = world::ParseScenario(scenario_->yaml, log + ": SCENARIO");
    record.seed = scenario_->seed;
    record.origin_utime = origin_ = MissionStart(truth_.front());
    AddTruth(&record);
    AddHeard(&record);
    AddStates(&record);
    AddEstimates(&record);
    AddPlans(&record);
    AddFaults(&record);
    AddStatuses(&record);
    record.memory = memory_;
    for (const auto& [sweep, latency] : sweeps_.samples())
      record.sweep_to_setpoint_ms.emplace_back(Time(sweep), 1e-3 * static_cast<double>(latency));
    if (obstacles_) record.obstacles = PerceivedIn(*obstacles_);
    AddRealTimeFactor(&record);
    return record;
  }

 private:
  /// Its times are as if nobody had set the clock.
  template <class T>
  void Settle(T* m) const {
    const int64_t by = clock_.SetBy(m->utime);
    m->utime -= by;
    if constexpr (std::is_same_v<T, prediction_t>) m->target.utime -= by;
    if constexpr (std::is_same_v<T, plan_t>)
      for (polynomial_t* p : {&m->position, &m->target, &m->stop}) p->utime -= by;
  }
  template <class T>
  bool Take(const LogEvent& e, const std::string& name, std::vector<T>* messages) {
    T message;
    if (!Good(e, name, &message)) return false;
    Settle(&message);
    messages->push_back(std::move(message));
    return true;
  }
  /// Takes what may get too old, too.
  template <class T>
  void Hear(const LogEvent& e, const std::string& name, std::vector<T>* messages) {
    if (Take(e, name, messages)) heard_[name].emplace_back(Heard(), messages->back().utime);
  }
  /// By the truth's clock, which counts the flight's time however fast the log's stamps run.
  int64_t Heard() const {
    return truth_.empty() ? clock_.now() : truth_.back().utime + clock_.now() - last_event_;
  }
  template <class T>
  static void TakeLast(const LogEvent& e, const std::string& name, std::optional<T>* message) {
    T fresh;
    if (Good(e, name, &fresh)) *message = std::move(fresh);
  }

  /// One that is not sound is what is looked for.
  void AddSetpoint(const LogEvent& e) {
    attitude_setpoint_t m;
    if (!IsOn(e, "ATTITUDE_SETPOINT") || !DecodeBytes(e.bytes, &m)) return;
    const auto finite = [](double v) { return std::isfinite(v); };
    if (bus::Problem(m).empty())
      heard_["ATTITUDE_SETPOINT"].emplace_back(Heard(), clock_.Settled(m.utime));
    nonfinite_setpoints_ += !std::all_of(m.orientation, m.orientation + 4, finite) ||
                            !std::all_of(m.body_rate, m.body_rate + 3, finite) || !finite(m.thrust);
  }

  double Time(int64_t utime) const { return bus::Seconds(utime, origin_); }

  void AddTruth(FlightRecord* record) const {
    for (const truth_t& m : truth_) record->truth.push_back(ToSample(m, origin_));
    std::stable_sort(record->truth.begin(), record->truth.end(),
                     [](const TruthSample& a, const TruthSample& b) { return a.t < b.t; });
  }

  void AddHeard(FlightRecord* record) const {
    for (const auto& [channel, samples] : heard_)
      for (const auto& [heard, stamp] : samples)
        record->heard[channel].push_back({Time(heard), Time(stamp)});
    for (size_t i = 0; i < tracking_.size(); ++i)
      record->tracking.push_back(
          {Time(tracking_heard_[i]), tracking_[i].following, tracking_[i].plan_seq});
    for (const status_t& m : autopilot_)
      record->autopilot.push_back({Time(m.utime), LandingWatch::Lands(m)});
    record->nonfinite_setpoints = nonfinite_setpoints_;
  }

  void AddStates(FlightRecord* record) const {
    for (const flight_state_t& m : states_)
      if (record->states.empty() || record->states.back().state != m.state)
        record->states.push_back({Time(m.utime), m.state, m.reason});
    size_t state = 0, tracking = 0, status = 0;
    LandingWatch landing;
    const auto hear = [&](const auto& messages, size_t* next, double t) {
      for (; *next < messages.size() && Time(messages[*next].utime) <= t; ++*next)
        landing.Hear(messages[*next]);
    };
    for (TruthSample& s : record->truth) {
      hear(states_, &state, s.t);
      hear(tracking_, &tracking, s.t);
      hear(autopilot_, &status, s.t);
      landing.Mark(record->scenario.world.ground, &s);
    }
  }

  void AddEstimates(FlightRecord* record) const {
    for (const pose_t& m : poses_)
      if (m.health != pose_t::HEALTH_STARTING)
        record->poses.push_back({Time(m.utime), bus::ToVector(m.pos),
                                 math::Yaw(bus::ToQuaternion(m.orientation)), m.epoch});
    for (const target_t& m : targets_)
      record->targets.push_back({Time(m.utime), m.state == target_t::TRACKING,
                                 bus::ToVector(m.mean), bus::ToVector(m.velocity),
                                 m.state == target_t::TRACKING || m.state == target_t::OCCLUDED,
                                 m.epoch});
  }

  void AddPlans(FlightRecord* record) const {
    for (const prediction_t& m : predictions_)
      record->predictions.push_back({Time(m.utime), m.verdict != prediction_t::NO_TARGET,
                                     bus::FromMessage(m.target, origin_), m.epoch});
    for (size_t i = 0; i < plans_.size(); ++i) {
      const plan_t& m = plans_[i];
      PlanSample plan{Time(m.utime),
                      m.verdict,
                      bus::FromMessage(m.position, origin_),
                      {},
                      m.certified_clearance,
                      m.hard_radius,
                      Time(plans_heard_[i]),
                      m.seq};
      if (m.stop.n_coefficients > 0) plan.stop = bus::FromMessage(m.stop, origin_);
      record->plans.push_back(std::move(plan));
    }
  }

  void AddFaults(FlightRecord* record) const {
    for (const event_t& m : faults_)
      if (m.phase == event_t::BEGINS) record->faults.push_back({Time(m.utime), m.name, EndOf(m)});
    std::stable_sort(record->faults.begin(), record->faults.end(),
                     [](const FaultSample& a, const FaultSample& b) { return a.t < b.t; });
  }

  std::optional<double> EndOf(const event_t& begin) const {
    const auto end = std::find_if(faults_.begin(), faults_.end(), [&](const event_t& m) {
      return m.phase == event_t::ENDS && m.name == begin.name && m.utime >= begin.utime;
    });
    return end == faults_.end() ? std::nullopt : std::optional(Time(end->utime));
  }

  void AddStatuses(FlightRecord* record) const {
    for (const auto& [name, status] : statuses_) {
      if (status.cpu > 0.0) record->cpu_s[name] = status.cpu;  // not measured in lockstep
      for (const stage_status_t& s : status.stages)
        record->stages.push_back(
            {name, s.name, static_cast<long>(s.count), s.mean_ms, s.p50_ms, s.p99_ms, s.max_ms});
    }
  }

  /// Logical time over the log's own stamps; a lockstep log's stamps are logical too, so it has
  /// none worth the name.
  void AddRealTimeFactor(FlightRecord* record) const {
    const double logical = bus::Seconds(truth_.back().utime, truth_.front().utime);
    const double logged = bus::Seconds(last_event_, first_event_.value_or(last_event_));
    if (logged > 0.0) record->real_time_factor = logical / logged;
  }

  const LogClock& clock_;
  int64_t origin_ = 0;
  std::optional<int64_t> first_event_;
  int64_t last_event_ = 0;
  std::vector<truth_t> truth_;
  std::vector<pose_t> poses_;
  std::vector<target_t> targets_;
  std::vector<prediction_t> predictions_;
  std::vector<plan_t> plans_;
  std::vector<event_t> faults_;
  std::vector<flight_state_t> states_;
  std::vector<tracking_t> tracking_;
  std::vector<int64_t> plans_heard_, tracking_heard_;                      // us
  std::map<std::string, std::vector<std::pair<int64_t, int64_t>>> heard_;  // when, stamp; us
  long nonfinite_setpoints_ = 0;
  std::optional<scenario_t> scenario_;
  std::optional<obstacles_t> obstacles_;
  std::map<std::string, status_t> statuses_;
  std::vector<status_t> autopilot_;  // of the bridge
  std::map<std::string, std::vector<MemorySample>> memory_;
  SweepLatency sweeps_;
};

}  // namespace

int64_t MissionStart(const truth_t& truth) {
  return truth.utime - std::llround(truth.mission_time * 1e6);
}

TruthSample ToSample(const truth_t& m, int64_t start) {
  TruthSample s;
  s.t = bus::Seconds(m.utime, start);
  s.p = bus::ToVector(m.pos);
  s.a = bus::ToVector(m.accel);
  s.speed = bus::ToVector(m.vel).norm();
  s.yaw = Yaw(m.orientation);
  s.target_yaw = m.target_yaw;
  s.target = bus::ToVector(m.target_pos);
  s.target_px = {m.target_px[0], m.target_px[1]};
  s.target_in_image = m.target_in_image != 0;
  s.visible_share = m.visible_share;
  return s;
}

std::vector<PerceivedObstacle> PerceivedIn(const obstacles_t& m) {
  std::vector<PerceivedObstacle> perceived;
  for (const obstacle_t& o : m.obstacles) {
    if (o.kind == obstacle_t::GROUND) continue;
    const world::Obstacle obstacle = bus::FromMessage(o, m.utime);
    perceived.push_back({obstacle.center.Position(0.0), obstacle.shape, obstacle.moving});
  }
  return perceived;
}

FlightRecord ReadFlight(const std::string& log) {
  LogReader reader(log);
  LogSurvey survey;
  Gatherer gatherer(survey.clock());
  for (LogEvent e; reader.Next(&e);) {
    survey.Add(e);
    gatherer.Add(e);
  }
  LogInfo info = survey.Take(reader);
  info.RequireOneVehicle();
  FlightRecord record = gatherer.Record(log);
  record.log = std::move(info);
  return record;
}

}  // namespace chase::logs
