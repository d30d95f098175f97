#include "services/planning/pilot.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/rotation.h"
#include "common/world/ages.h"
#include "services/planning/margins.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

constexpr double kShortestHorizon = 1.0;

// The target's upright cylinder where it is forecast to be.
std::optional<world::Obstacle> TargetBody(const Forecast& f) {
  if (!(f.radius > 0.0 && f.height > 0.0)) return std::nullopt;
  world::Obstacle body;
  body.id = kTargetId;
  body.moving = true;
  body.center = f.target;
  body.solid = world::Obstacle::Solid::kCylinder;
  body.half = {f.radius, f.radius, 0.5 * f.height};
  body.shape = body.half.cwiseAbs2().cwiseInverse().asDiagonal();
  body.position_covariance = f.covariance;
  body.velocity_covariance = f.velocity_covariance;
  return body;
}

// One of whom prediction tells no more stays where its forecast ends at the latest: it could be
// anywhere soon, and there is no way to rest from that.
void LeaveAt(double t, world::Obstacle* body) {
  const double last = std::min(t, body->center.end());
  body->center = world::Trajectory::Constant(body->center.Position(last), t, 1.0);
  body->velocity_covariance.setZero();
}

// What plan and stop leave beyond the hard radius, m.
double ClearanceOf(const PlanResult& plan, double hard) {
  return std::min(plan.certified_clearance, std::max(0.0, LeastKept(plan.stop_proofs) - hard));
}

bool IsFinite(const PlanResult& plan) {
  if (!plan.trajectory.coefficients.allFinite()) return false;
  return std::all_of(plan.yaw.begin(), plan.yaw.end(), [](double y) { return std::isfinite(y); });
}

}  // namespace

Pilot::Pilot(const PlanningConfig& config)
    : config_(config),
      planner_(MakePlanner(config.planner_name, config.planner)),
      tube_{config.planner.tracking_tube},
      search_(config) {}

void Pilot::SetTrackingBound(double t, double bound) {
  tracking_time_ = t;
  tracking_bound_ = std::isfinite(bound) ? std::max(bound, 0.0) : kWidestTube;
}

double Pilot::TrackingBound(double t) const {
  if (!tracking_time_) return config_.planner.tracking_tube;
  return world::IsFresh(t - *tracking_time_, world::kMostAge.tracking) ? tracking_bound_
                                                                       : kWidestTube;
}

void Pilot::SetForecast(const Forecast& forecast) {
  forecast_ = forecast;
  news_ = true;
}

void Pilot::SetObstacles(double t, std::vector<world::Obstacle> obstacles) {
  obstacles_time_ = t;
  obstacles_ = std::move(obstacles);
  news_ = true;
}

void Pilot::SetUnseen(double t, std::vector<world::Obstacle> unseen) {
  unseen_time_ = t;
  unseen_ = std::move(unseen);
}

void Pilot::ChangeFrame() {
  forecast_.reset();
  search_.Clear();
  hovers_since_.reset();
  obstacles_.clear();
  unseen_.clear();
  expected_since_.reset();
  if (unseen_time_) unseen_time_ = -1e9;  // they are told of: to be heard anew
  obstacles_time_ = -1e9;
  airborne_ = airborne_ || flies_;  // a climb is not begun anew
  climb_top_.reset();
  has_running_ = false;
  home_.reset();
  trail_.Clear();
  way_back_.Reset();
  way_down_.Reset();
}

void Pilot::SetTask(Task task, const std::optional<Eigen::Vector3d>& home) {
  if (task_ != task) {
    way_back_.Reset();
    way_down_.Reset();
    news_ = true;  // to be obeyed at once
  }
  task_ = task;
  home_ = home;
}

bool Pilot::SeesObstacles(double t) const {
  constexpr double kTellsNone = 0.5;  // s: five lists without any
  const double most = world::kMostAge.obstacles;
  if (!world::IsFresh(t - obstacles_time_, most)) return false;
  if (unseen_time_) return world::IsFresh(t - *unseen_time_, most);
  return !expected_since_ || t - *expected_since_ > kTellsNone;
}

bool Pilot::HasTarget(double t) const {
  return forecast_ && forecast_->has_target &&
         world::IsFresh(t - forecast_->t, world::kMostAge.prediction);
}

bool Pilot::IsDue(double t) const {
  const double age = t - last_planned_;
  if (!has_running_ || age >= config_.replan_period - 1e-6) return true;
  return news_ && age >= config_.min_period - 1e-6;
}

// Nobody climbs who waits; under a mission nobody before control has been heard, or who is not told
// to.
bool Pilot::MayPlan(double t) const {
  if (task_ == Task::kDone) return false;
  if (has_running_ || airborne_) return true;
  if (waits_ || !SeesObstacles(t)) return false;
  return !task_ || (heard_control_ && (task_ == Task::kTakeoff || task_ == Task::kChase));
}

std::optional<PlanResult> Pilot::Update(double t, const BodyEstimate& body) {
  if (has_running_ && t < last_planned_ - world::kSetBack) ChangeFrame();  // of the clock
  tube_ = MakeTube(config_, body, TrackingBound(t), Chases());
  const double t0 = t + config_.latency;
  const Start start = StartAt(t, t0, body);
  news_ = news_ || !start.follows;
  if (task_ && airborne_) trail_.Add(body.p);
  if (!IsDue(t) || !MayPlan(t)) return std::nullopt;
  if (HasTarget(t)) search_.Saw(*forecast_);
  const bool stands = !airborne_ && !has_running_;
  if (stands && !IsFree(t0, start, Climb(t0, body).trajectory)) return std::nullopt;
  PlanResult plan = !Chases()                                       ? Obey(t0, start, body)
                    : airborne_ && HasTarget(t) && SeesObstacles(t) ? Chase(t0, start)
                                                                    : Wait(t0, start, body);
  if (plan.certified_clearance >= 0.0 && ClearanceOf(plan, hard_radius()) < tube_.beyond)
    plan = AsLastResort("the body strays farther than a plan keeps clear", Rest(t0, start));
  else if (plan.certified_clearance >= 0.0)
    plan.certified_clearance -= tube_.beyond;
  if (!IsFinite(plan))
    plan = AsLastResort("the plan is not finite", Rest(t0, {{body.p}, {body.yaw}}));
  if (expected_since_ && !unseen_time_) Note(&plan.reason, "nobody tells what is unseen");
  running_ = plan;
  has_running_ = true;
  last_planned_ = t;
  news_ = false;
  return plan;
}

// On the running plan, on its stop from when that begins, as control does; at rest once it is over.
// On the estimate when there is no plan or the body has left the tube about it.
Pilot::Start Pilot::StartAt(double t, double t0, const BodyEstimate& body) const {
  const bool flies = has_running_ || airborne_;
  const Eigen::Vector3d v = flies ? body.v : Eigen::Vector3d::Zero();
  const Start estimate{{body.p + (t0 - t) * v, v}, {body.yaw, 0.0}, false, !has_running_};
  if (!has_running_) return estimate;
  const world::Trajectory& way = FlownAt(t);
  const double now = std::clamp(t, way.start, way.end());  // the newest plan may not have begun
  const Eigen::Vector3d then = body.p + std::max(0.0, now - t) * body.v;
  if ((way.Position(now) - then).norm() > config_.planner.tracking_tube) return estimate;
  const world::Trajectory &flown = FlownAt(t0), &plan = running_.trajectory;
  const double left = std::min(flown.start, plan.end());  // of the plan, where its stop is flown
  const bool on_plan = &flown == &plan;
  const double tau = std::clamp(((on_plan ? t0 : left) - plan.start) / plan.duration, 0.0, 1.0);
  Start start{flown.At(std::clamp(t0, flown.start, flown.end())),
              YawAt(running_.yaw, tau, plan.duration), on_plan};
  if (!on_plan) start.yaw = world::YawOnStop(start.yaw, flown.duration, t0 - left);
  if (t0 >= flown.end()) {
    start.state.v = start.state.a = start.state.j = Eigen::Vector3d::Zero();
    start.yaw.rate = 0.0;
  }
  return start;
}

const world::Trajectory& Pilot::FlownAt(double t) const {
  return running_.stop && t >= running_.stop->start ? *running_.stop : running_.trajectory;
}

PlanRequest Pilot::Request(double t0, const Start& start) const {
  PlanRequest request;
  request.t0 = t0;
  request.start = start.state;
  request.yaw = start.yaw;
  request.tube = tube_.radius;
  request.obstacles = obstacles_;
  request.unseen = unseen_;
  const double since = std::clamp(t0 - obstacles_time_, 0.0, world::kMostAge.obstacles);
  request.listed_within = config_.listed_within - HardRadius(config_.planner, request) -
                          since * start.state.v.head<2>().norm();
  if (start.follows && has_running_) request.stop = running_.stop;
  if (start.on_plan) request.running = running_.trajectory;  // off it, it is no way out
  // What moves is measured, as the target is, in the frame that drifts.
  for (world::Obstacle& o : request.obstacles)
    if (!o.moving) o.velocity_covariance += tube_.drift;
  for (world::Obstacle& o : request.unseen) o.velocity_covariance += tube_.drift;
  request.horizon = config_.horizon;
  if (!forecast_ || !forecast_->has_target) return request;
  request.target = forecast_->target;
  request.target_sigma = math::LargestSigma(forecast_->covariance);
  request.target_speed_sigma = math::LargestSigma(forecast_->velocity_covariance);
  request.target_body = TargetBody(*forecast_);
  if (HasTarget(t0 - config_.latency))
    request.target_manoeuvre = {config_.target_acceleration, config_.target_memory};
  else if (request.target_body)
    LeaveAt(t0, &*request.target_body);
  request.horizon = std::clamp(forecast_->target.end() - t0, kShortestHorizon, config_.horizon);
  return request;
}

PlanResult Pilot::Chase(double t0, const Start& start) {
  chased_ = true;
  return planner_->Plan(Request(t0, start));
}

}  // namespace chase::planning
