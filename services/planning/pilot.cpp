#include "services/planning/pilot.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/rotation.h"
#include "common/world/ages.h"
#include "common/world/column.h"
#include "services/planning/resting.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

constexpr double kShortestHorizon = 1.0;
constexpr double kLeg = 2.5;      // desired distances: the planner is led to nothing farther off
constexpr double kGoes = 0.5;     // m: a plan that looks for it is worth that at least
constexpr double kSettles = 0.3;  // s: a turn ends so

// Rest to rest from a to b, minimum jerk.
world::Trajectory RestToRest(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double start,
                             double duration) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> c = Eigen::MatrixXd::Zero(6, 3);
  c.row(0) = a.transpose();
  c.row(3) = 10.0 * (b - a).transpose();
  c.row(4) = -15.0 * (b - a).transpose();
  c.row(5) = 6.0 * (b - a).transpose();
  return {start, duration, c};
}

bool Moves(const world::Obstacle& o) { return o.moving; }

bool IsAtRest(const world::State& s) { return s.v.norm() < 0.05 && s.a.norm() < 0.1; }

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

// The climb, with a stop that control flies when no newer plan comes. Neither is certified.
PlanResult StoppingSoon(double t0, PlanResult climb) {
  constexpr double kOver = kBrakeTimes[2];
  const double t = t0 + kOverdue;
  climb.stop.reset();
  if (t < climb.trajectory.end())
    climb.stop = {t, kOver, BrakeCurve(climb.trajectory.At(t), kOver)};
  return climb;
}

// What plan and stop leave to sphere and tube, m.
double ClearanceOf(const PlanResult& plan) {
  double least = plan.certified_clearance;
  for (const Proof& p : plan.stop_proofs) least = std::min(least, p.from > 0.0 ? 0.0 : p.room);
  return least;
}

// What it proves does not hold.
PlanResult AsLastResort(const std::string& why, PlanResult plan) {
  plan.proofs.clear();
  plan.stop_proofs.clear();
  plan.certified_clearance = -1.0;
  if (plan.verdict == Verdict::kEscape) plan.verdict = Verdict::kMitigate;
  if (plan.verdict < Verdict::kBrake) plan.verdict = Verdict::kBrake;
  plan.reason = why + (plan.reason.empty() ? "" : "; " + plan.reason);
  return plan;
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
  const double most = world::kMostAge.obstacles;
  return world::IsFresh(t - obstacles_time_, most) &&
         world::IsFresh(t - unseen_time_.value_or(t), most);
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
  if (plan.certified_clearance >= 0.0 && ClearanceOf(plan) < tube_.beyond)
    plan = AsLastResort("the body strays farther than a plan keeps clear", Rest(t0, start));
  else if (plan.certified_clearance >= 0.0)
    plan.certified_clearance -= tube_.beyond;
  if (!IsFinite(plan)) plan = Rest(t0, {{body.p}, {body.yaw}});
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
  if (!on_plan) {  // its rate falls evenly over the stop
    const double s = std::min((t0 - left) / flown.duration, 1.0);
    start.yaw.yaw += start.yaw.rate * flown.duration * (s - 0.5 * s * s);
    start.yaw.rate *= 1.0 - s;
  }
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
  request.target = world::Trajectory::Constant(start.state.p, t0, config_.horizon);
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

PlanResult Pilot::Wait(double t0, const Start& start, const BodyEstimate& body) {
  if (!airborne_ && !has_running_) {
    PlanResult climb = StoppingSoon(t0, Climb(t0, body));
    climb_end_ = climb.trajectory.end();
    climb_top_ = climb.trajectory.Position(climb_end_);
    return climb;
  }
  const bool stops = running_.stop && t0 >= running_.stop->start;
  if (!airborne_ && !stops && t0 < climb_end_ && IsFree(t0, start, running_.trajectory))
    return StoppingSoon(t0, running_);  // still climbing
  airborne_ = true;
  if (task_ == Task::kTakeoff) return ClimbOn(t0, start, body);
  if (!SeesObstacles(t0 - config_.latency)) return Rest(t0, start);
  if (HasTarget(t0 - config_.latency)) return Chase(t0, start);
  return search_.has_seen() ? Search(t0, start, body) : Hover(t0, start);
}

// Nothing reaches into the rest of the climb, and no mover comes to it for as long as a stop takes,
// nor the target as it is forecast: what it may do besides reaches everybody who stands near it.
bool Pilot::IsFree(double t0, const Start& start, const world::Trajectory& climb) const {
  constexpr double kStopTakes = 1.5;  // s: from the climb's 0.75 m/s, and to be seen
  if (!SeesObstacles(t0 - config_.latency)) return false;
  const Eigen::Vector3d& p = start.state.p;
  const double rest = climb.Position(climb.end()).z() - p.z();
  if (world::IsColumnBlocked(obstacles_, p, config_.planner.hard_radius(), rest)) return false;
  PlanRequest request = Request(t0, start);
  request.horizon = kStopTakes;
  request.target_manoeuvre = {};
  if (request.target_body) request.target_body->velocity_covariance.setZero();
  return KeepsOffMovers(config_.planner, request, climb);
}

// A climb that was broken off goes on, certified, once it can.
PlanResult Pilot::ClimbOn(double t0, const Start& start, const BodyEstimate& body) {
  constexpr double kThere = 0.05;  // m
  if (!climb_top_ && home_)        // whoever began the climb has died
    climb_top_ = *home_ + config_.takeoff_height * Eigen::Vector3d::UnitZ();
  if (!climb_top_ || (*climb_top_ - start.state.p).norm() < kThere)
    return Hold(t0, start, "climbed");
  const PlanRequest request = Request(t0, start);
  std::optional<Stop> leg;
  if (SeesObstacles(t0 - config_.latency)) {
    const world::Trajectory& way = running_.trajectory;
    if (start.on_plan && (way.Position(way.end()) - *climb_top_).norm() < kThere)
      leg = GoOn(config_.planner, request, way);
    if (!leg) leg = GoTo(config_.planner, request, *climb_top_);
  }
  if (!leg)
    return Hold(t0, start, "climb broken off: somebody comes, or obstacles are not heard of");
  return Along(request, start, std::move(*leg), InFence(body.p), "climbing");
}

PlanResult Pilot::Obey(double t0, const Start& start, const BodyEstimate& body) {
  if (task_ == Task::kTakeoff) return Wait(t0, start, body);
  airborne_ = true;  // a climb ends here
  if (task_ == Task::kLand) return Land(t0, start, body);
  return task_ == Task::kReturn ? Return(t0, start, body) : Hold(t0, start, "holding");
}

PlanResult Pilot::Hold(double t0, const Start& start, const std::string& reason) const {
  PlanResult plan = Rest(t0, start);
  plan.reason = reason + (plan.reason.empty() ? "" : ", " + plan.reason);
  return plan;
}

// Control flies none that leaves the fence.
MayFly Pilot::InFence(const Eigen::Vector3d& p_WB) const {
  return [this, p_WB](const world::Trajectory& leg) {
    if (!fence_.Exists() || !home_) return true;
    std::vector<Eigen::Vector3d> places = world::PlacesOn(leg, std::nullopt);
    for (Eigen::Vector3d& p : places) p -= *home_;
    return fence_.Refusal(p_WB - *home_, places, tube_.radius).empty();
  };
}

bool Pilot::IsInFence(const Eigen::Vector3d& p_WB, const PlanResult& plan) const {
  const MayFly may_fly = InFence(p_WB);
  return may_fly(plan.trajectory) && (!plan.stop || may_fly(*plan.stop));
}

PlanResult Pilot::Return(double t0, const Start& start, const BodyEstimate& body) {
  if (!home_) return Hold(t0, start, "the take-off place is not known");
  const Eigen::Vector3d above = *home_ + config_.takeoff_height * Eigen::Vector3d::UnitZ();
  const PlanRequest request = Request(t0, start);
  std::optional<Stop> leg =
      way_back_.Leg(config_.planner, request, trail_, above,
                    start.on_plan ? &running_.trajectory : nullptr, InFence(body.p));
  if (!leg || !SeesObstacles(t0 - config_.latency)) return Hold(t0, start, "no way back");
  return Along(request, start, std::move(*leg), InFence(body.p), "returning");
}

// A long leg that nobody could stop soon is not flown among movers, but to level ground.
PlanResult Pilot::Along(const PlanRequest& request, const Start& start, Stop leg,
                        const MayFly& may_fly, const std::string& reason) const {
  const bool leaves = LeavesObstacles(leg.proofs);
  PlanResult plan;
  plan.verdict = leaves ? Verdict::kEscape : Verdict::kSafeOnly;
  plan.trajectory = std::move(leg.trajectory);
  plan.yaw = {start.yaw.yaw};
  SetProofs(config_.planner, request, std::move(leg.proofs), &plan);
  auto stop = WayOut(config_.planner, request, plan.trajectory, leaves);
  if (stop && may_fly(stop->trajectory)) {
    plan.stop = std::move(stop->trajectory);
    plan.stop_proofs = std::move(stop->proofs);
  }
  const double left = plan.stop ? plan.stop->start : plan.trajectory.end();
  if (task_ != Task::kLand && left - request.t0 > kLongestBrake &&
      std::any_of(request.obstacles.begin(), request.obstacles.end(), Moves))
    return Hold(request.t0, start, reason + " would have no stop within 3 s");
  plan.reason = reason;
  return plan;
}

// A plan that ends where it starts lets control come down: it does so above the end of a plan only.
PlanResult Pilot::Land(double t0, const Start& start, const BodyEstimate& body) {
  PlanResult here = Hold(t0, start, "landing");
  if (descending_ || !SeesObstacles(t0 - config_.latency)) return here;
  const PlanRequest request = Request(t0, start);
  const LandingNeeds needs{config_.planner.drone_radius + config_.landing_room,
                           std::tan(config_.landing_slope_deg * M_PI / 180.0),
                           config_.landing_reach};
  WayDown::Answer answer = way_down_.Lead(
      config_.planner, request, needs, here.trajectory.Position(here.trajectory.end()), home_,
      start.on_plan ? &running_.trajectory : nullptr, InFence(body.p));
  const std::string reason = "landing, " + answer.reason;
  if (answer.leg) return Along(request, start, std::move(*answer.leg), InFence(body.p), reason);
  here.reason = reason;
  return here;
}

PlanResult Pilot::Climb(double t0, const BodyEstimate& body) const {
  const Eigen::Vector3d top = body.p + config_.takeoff_height * Eigen::Vector3d::UnitZ();
  PlanResult plan;
  plan.verdict = Verdict::kWait;
  plan.reason = "climbing";
  plan.trajectory = RestToRest(body.p, top, t0, config_.takeoff_time);
  plan.yaw = {body.yaw};
  return plan;
}

PlanResult Pilot::Search(double t0, const Start& start, const BodyEstimate& body) {
  // Where prediction is silent the target may be in sight, and mapping lists nothing of it.
  if (forecast_->has_target) return Hold(t0, start, "target lost, prediction is silent");
  const TargetSearch::Lead lead =
      search_.Advance(t0 - config_.latency, obstacles_, body, start.state.p, start.yaw.yaw);
  if (!lead.place) return BrakeAndLook(t0, start, lead.yaw);
  const Eigen::Vector2d way = (*lead.place - start.state.p).head<2>();
  PlanRequest request = Request(t0, start);
  const double near = std::min(1.0, kLeg * config_.planner.desired_distance / way.norm());
  request.target = world::Trajectory::Constant(
      {start.state.p.x() + near * way.x(), start.state.p.y() + near * way.y(), lead.place->z()}, t0,
      request.horizon);
  PlanResult plan = planner_->Plan(request);
  const Eigen::Vector3d end = plan.trajectory.Position(plan.trajectory.end());
  if (plan.verdict >= Verdict::kBrake || (end - start.state.p).norm() < kGoes)
    return BrakeAndLook(t0, start, lead.yaw);
  // What it proves of sight is of that place, which whoever checks it takes for the target's.
  plan.proofs.erase(std::remove_if(plan.proofs.begin(), plan.proofs.end(),
                                   [](const Proof& proof) { return proof.of_sight; }),
                    plan.proofs.end());
  plan.verdict = Verdict::kSafeOnly;
  plan.reason = "target lost, to where it may be" + (plan.reason.empty() ? "" : "; " + plan.reason);
  return plan;
}

// Braking while it moves; else where it is, for as long as that can be certified.
PlanResult Pilot::Rest(double t0, const Start& start) const {
  const bool sees = SeesObstacles(t0 - config_.latency);
  PlanRequest request = Request(t0, start);
  PlanResult plan =
      sees ? RestPlan(config_.planner, request) : RestWithoutLists(std::move(request));
  plan.yaw = {start.yaw.yaw};
  const bool waits = plan.reason.empty() && plan.verdict != Verdict::kEscape;
  if (waits && IsAtRest(start.state)) plan.verdict = Verdict::kWait;
  return sees ? plan : AsLastResort("obstacles are not heard of", std::move(plan));
}

// Without new lists. What was committed to was certified against where movers would go, which no
// braking knows any more. After it, or where nobody moved, it brakes: moving obstacles are left out
// and what stands is where it was listed: uncertainty would grow until it covers every place, and
// fleeing from it leads into space that nobody observes.
PlanResult Pilot::RestWithoutLists(PlanRequest request) const {
  std::vector<world::Obstacle>& listed = request.obstacles;
  // A climb or a hover has committed itself to nothing that was certified.
  if (running_.verdict != Verdict::kWait && std::any_of(listed.begin(), listed.end(), Moves))
    if (auto plan = AsCommitted(request); plan && IsInFence(request.start.p, *plan)) return *plan;
  listed.erase(std::remove_if(listed.begin(), listed.end(), Moves), listed.end());
  for (world::Obstacle& o : listed) o.velocity_covariance.setZero();
  request.unseen.clear();
  request.tube = 0.0;
  return RestPlan(config_.planner, request);
}

// A target that was chased before the frame changed, and is not seen soon after it, may be anywhere
// around. One that was never seen is waited for longer: perception needs time for a target that
// stands.
PlanResult Pilot::Hover(double t0, const Start& start) {
  constexpr double kSoon = 4.0;   // s: perception takes 3 for one that stands within 5 m
  constexpr double kLong = 10.0;  // s: chosen; so that whoever is in view is not turned away from
  if (!hovers_since_) hovers_since_ = t0;
  if (t0 - *hovers_since_ > (chased_ ? kSoon : kLong))
    return BrakeAndLook(t0, start, start.yaw.yaw + 0.5 * M_PI);
  PlanResult plan = Rest(t0, start);
  if (plan.verdict == Verdict::kWait) plan.reason = "nothing to chase yet";
  return plan;
}

PlanResult Pilot::BrakeAndLook(double t0, const Start& start, double yaw) const {
  PlanResult plan = Rest(t0, start);
  const double turn = std::remainder(yaw - start.yaw.yaw, 2.0 * M_PI);
  const double rate =
      std::clamp(turn / kSettles, -config_.search_yaw_rate, config_.search_yaw_rate);
  plan.yaw = TurningYaw({start.yaw.yaw, rate}, plan.trajectory.duration);
  plan.reason = (plan.verdict == Verdict::kWait ? "target lost, looking around" : "target lost") +
                (plan.reason.empty() ? "" : ", " + plan.reason);
  return plan;
}

}  // namespace chase::planning
