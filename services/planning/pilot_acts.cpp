#include <algorithm>
#include <cmath>

#include "common/world/column.h"
#include "services/planning/pilot.h"
#include "services/planning/resting.h"
#include "services/planning/stopping.h"

// What the pilot flies when it does not chase.

namespace chase::planning {
namespace {

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

// The climb, with a stop that control flies when no newer plan comes. Neither is certified.
PlanResult StoppingSoon(double t0, PlanResult climb) {
  constexpr double kOver = kBrakeTimes[2];
  const double t = t0 + kOverdue;
  climb.stop.reset();
  if (t < climb.trajectory.end())
    climb.stop = {t, kOver, BrakeCurve(climb.trajectory.At(t), kOver)};
  return climb;
}

}  // namespace

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
