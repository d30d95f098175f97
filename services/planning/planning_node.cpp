#include "services/planning/planning_node.h"

#include <fmt/format.h>

#include <cmath>

#include "common/bus/convert.h"
#include "common/bus/plan_message.h"
#include "common/math/rotation.h"
#include "common/world/ages.h"

namespace chase::planning {
namespace {

constexpr int kMaxCoefficients = 3 * 9;  // degree 8
constexpr size_t kMaxObstacles = 1000;

BodyEstimate FromMessage(const pose_t& m) {
  const Eigen::Map<const Eigen::Matrix<double, 9, 9, Eigen::RowMajor>> P(m.local_covariance);
  return {bus::ToVector(m.pos), bus::ToVector(m.vel), math::Yaw(bus::ToQuaternion(m.orientation)),
          P.block<3, 3>(0, 0), P.block<3, 3>(3, 3)};
}

Task TaskOf(int8_t state) {
  switch (state) {
    case flight_state_t::IDLE:
    case flight_state_t::READY:
      return Task::kGround;
    case flight_state_t::TAKEOFF:
      return Task::kTakeoff;
    case flight_state_t::CHASE:
    case flight_state_t::SEARCH:
      return Task::kChase;
    case flight_state_t::RETURN:
      return Task::kReturn;
    case flight_state_t::LAND:
      return Task::kLand;
    case flight_state_t::DONE:
      return Task::kDone;
    default:
      return Task::kHold;
  }
}

polynomial_t At(const Eigen::Vector3d& p, int64_t utime, double duration) {
  polynomial_t m{};
  m.utime = utime;
  m.duration = duration;
  m.n_coefficients = 3;
  m.coefficients = {p.x(), p.y(), p.z()};
  return m;
}

plan_t ToMessage(const PlanResult& plan, int64_t origin) {
  plan_t m{};
  m.utime = bus::Utime(plan.trajectory.start, origin);
  m.verdict = static_cast<int8_t>(plan.verdict);
  m.reason = plan.reason;
  m.position = bus::ToMessage(plan.trajectory, origin);
  m.n_yaw = static_cast<int32_t>(plan.yaw.size());
  m.yaw = plan.yaw;
  const double cost[5] = {plan.cost.j1, plan.cost.j2, plan.cost.j3, plan.cost.j4, plan.cost.total};
  for (int i = 0; i < 5; ++i) m.cost[i] = std::isfinite(cost[i]) ? cost[i] : 0.0;
  m.generated = plan.generated;
  m.checked = plan.checked;
  m.feasible = plan.feasible;
  m.certified_clearance = plan.certified_clearance;
  m.proofs = bus::ToMessage(plan.proofs);
  m.n_proofs = static_cast<int32_t>(m.proofs.size());
  if (plan.stop) m.stop = bus::ToMessage(*plan.stop, origin);
  m.stop_proofs = bus::ToMessage(plan.stop_proofs);
  m.n_stop_proofs = static_cast<int32_t>(m.stop_proofs.size());
  return m;
}

}  // namespace

PlanningNode::PlanningNode(bus::Bus& bus, const PlanningConfig& config)
    : bus_(bus), config_(config), pilot_(config) {
  bus_.Subscribe<prediction_t>("PREDICTION", [this](const prediction_t& m) { OnPrediction(m); });
  bus_.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) { OnObstacles(m); });
  bus_.Subscribe<obstacles_t>("UNSEEN", [this](const obstacles_t& m) {
    if (auto list = Listed(m)) pilot_.SetUnseen(bus::Seconds(m.utime, *origin_), *std::move(list));
  });
  bus_.Subscribe<tracking_t>("TRACKING", [this](const tracking_t& m) {
    pilot_.SetFlying(m.following != tracking_t::NONE);
    pilot_.SetDescending(m.following == tracking_t::LAND);
    pilot_.SetTrackingBound(bus::Seconds(m.utime, Origin(m.utime)), m.bound);
  });
  bus_.Subscribe<flight_state_t>("FLIGHT_STATE", [this](const flight_state_t& m) { OnState(m); });
  bus_.Subscribe<status_t>("FCU_STATUS", [this](const status_t& m) { autopilot_.Hear(m); });
  bus_.Subscribe<geofence_t>("GEOFENCE", [this](const geofence_t& m) {
    if (home_ && epoch_.Is(m.epoch)) pilot_.SetFence(bus::FromMessage(m, *home_));
  });
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
}

void PlanningNode::OnPrediction(const prediction_t& message) {
  if (!epoch_.Is(message.epoch)) return;
  const int64_t origin = Origin(message.utime);
  Forecast forecast;
  forecast.t = bus::Seconds(message.utime, origin);
  forecast.has_target = message.verdict != prediction_t::NO_TARGET &&
                        message.target.n_coefficients >= 3 &&
                        message.target.n_coefficients <= kMaxCoefficients;
  if (forecast.has_target) {
    forecast.target = bus::FromMessage(message.target, origin);
    forecast.covariance = bus::ToMatrix(message.covariance);
    forecast.velocity_covariance = bus::ToMatrix(message.velocity_covariance);
    forecast.radius = message.radius;
    forecast.height = message.height;
    target_ = message.target;
  }
  pilot_.SetForecast(forecast);
}

// What a list leaves out is nowhere known to be free.
void PlanningNode::OnObstacles(const obstacles_t& message) {
  if (message.n_cut > 0)
    return bus_.ReportError(fmt::format(
        "OBSTACLES {} left out: {} more than the {} listed are near; raise mapping's max_obstacles",
        message.seq, message.n_cut, message.n_obstacles));
  auto list = Listed(message);
  if (!list) return;
  const double t = bus::Seconds(message.utime, *origin_);
  if (message.sender == "mapping") pilot_.ExpectUnseen(t);
  sweeps_.Add(t, is_usable_);
  pilot_.SetObstacles(t, *std::move(list));
}

std::optional<std::vector<world::Obstacle>> PlanningNode::Listed(const obstacles_t& message) {
  if (!epoch_.Is(message.epoch)) return std::nullopt;
  const int64_t origin = Origin(message.utime);
  std::vector<world::Obstacle> obstacles;
  for (const obstacle_t& o : message.obstacles)
    if (o.center.n_coefficients <= kMaxCoefficients && obstacles.size() < kMaxObstacles)
      obstacles.push_back(bus::FromMessage(o, origin));
  return obstacles;
}

void PlanningNode::OnState(const flight_state_t& message) {
  if (state_order_.IsOvertaken(message.utime)) return;
  state_utime_ = message.utime;
  task_ = TaskOf(message.state);
  const bool knows_home = message.has_home != 0 && epoch_.Is(message.epoch);
  home_ = knows_home ? std::optional(bus::ToVector(message.home)) : std::nullopt;
  pilot_.SetTask(task_, home_);
}

// Whoever leads the flight has fallen silent: what moves the vehicle about ends.
void PlanningNode::CheckMission(int64_t utime) {
  const bool moves = task_ == Task::kChase || task_ == Task::kReturn;
  if (state_utime_ == 0 || !moves) return;
  if (bus::Seconds(utime, state_utime_) > world::kMostAge.flight_state)
    pilot_.SetTask(Task::kHold, std::nullopt);
}

void PlanningNode::OnPose(const pose_t& message) {
  is_usable_ = message.health == pose_t::HEALTH_OK || message.health == pose_t::HEALTH_DEGRADED;
  if (!is_usable_) return;
  if (epoch_.Change(message.epoch)) {
    pilot_.ChangeFrame();
    sweeps_ = {};
    home_.reset();
    target_ = {};
  }
  CheckMission(message.utime);
  waits_for_autopilot_ = autopilot_.IsOnGround() && !autopilot_.Obeys(message.utime);
  pilot_.SetWaiting(!sweeps_.IsEnough() || waits_for_autopilot_);
  const double t = bus::Seconds(message.utime, Origin(message.utime));
  std::optional<PlanResult> plan;
  {
    auto timer = bus_.Time("plan");
    plan = pilot_.Update(t, FromMessage(message));
    if (!plan) timer.Cancel();  // no plan was due
  }
  if (plan) Send(*plan);
}

void PlanningNode::Send(const PlanResult& plan) {
  plan_t m = ToMessage(plan, *origin_);
  m.epoch = epoch_.value();
  m.hard_radius = pilot_.hard_radius();
  m.sigmas = config_.planner.sigmas;
  m.n_obstacles = pilot_.n_obstacles();
  m.target = target_.n_coefficients > 0
                 ? target_
                 : At(plan.trajectory.Position(plan.trajectory.end()), m.utime, 1.0);
  bus_.Publish("PLAN", m);
  ++n_plans_;
  ++n_verdicts_[m.verdict];
}

int64_t PlanningNode::Origin(int64_t utime) {
  if (!origin_) origin_ = utime;
  return *origin_;
}

const char* PlanningNode::WaitsFor() const {
  if (!is_usable_) return "waiting for a pose";
  if (!sweeps_.IsEnough()) return "waiting for ten lists in a row";
  if (waits_for_autopilot_) return "waiting for the autopilot";
  return "on the ground: not told to fly, or the way up is not free";
}

bus::NodeReport PlanningNode::Report() const {
  using State = bus::NodeReport::State;
  if (n_plans_ == 0) return {State::kStarting, WaitsFor()};
  const PlanResult& plan = pilot_.running();
  const bool well = plan.verdict == Verdict::kChase || plan.verdict == Verdict::kWait;
  return {
      well ? State::kOk : State::kDegraded,
      fmt::format("{}{}{}; {} plans: chase {}, wider {}, kept {}, safe only {}, brake {}",
                  Name(plan.verdict), plan.reason.empty() ? "" : ": ", plan.reason, n_plans_,
                  n_verdicts_[0], n_verdicts_[1], n_verdicts_[2], n_verdicts_[3], n_verdicts_[4])};
}

}  // namespace chase::planning
