#include "services/planning/resting.h"

#include <algorithm>
#include <cmath>

#include "common/world/shapes.h"
#include "services/planning/candidate_set.h"
#include "services/planning/limits.h"
#include "services/planning/separations.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr double kInTime = 0.05;  // s: contacts are sampled this often
constexpr double kAlike = 0.01;   // m of clearance that make no difference
constexpr double kAbove = 0.05;   // m, left to what the target's height is off
// tau by which the ground is left: from rest to rest a climb of 0.5 m is 0.34 m up by then, and
// slabs reach 0.3 m above what they stand for. The check allows as much: kLeaveGroundBy.
constexpr double kOutBy = 0.6;

// Of least squared jerk, from position, velocity and acceleration of s to rest over T: the first
// three coefficients in Bernstein form of degree n, and `end` for the others.
Curve ToRest(const world::State& s, double T, int n, const Vector3d& end) {
  Points b = end.transpose().replicate<7, 1>();
  const Vector3d way = T / n * s.v, bend = T * T / (n * (n - 1.0)) * s.a;
  b.row(0) = s.p.transpose();
  b.row(1) = (s.p + way).transpose();
  b.row(2) = (s.p + 2.0 * way + bend).transpose();
  return ToPower(b, n);
}

}  // namespace

Curve BrakeCurve(const world::State& s, double T) {
  return ToRest(s, T, 4, s.p + T / 2.0 * s.v + T * T / 12.0 * s.a);
}

Curve CurveTo(const world::State& s, double T, const Vector3d& end) { return ToRest(s, T, 5, end); }

double DistanceTo(const world::Obstacle& o, const Vector3d& d) {
  using Kind = world::Solid::Kind;
  if (o.solid == world::Obstacle::Solid::kBox)
    return world::SignedDistance({Kind::kBox, Vector3d::Zero(), o.half}, o.axes.conjugate() * d);
  if (o.solid == world::Obstacle::Solid::kCylinder)
    return world::SignedDistance({Kind::kCylinder, Vector3d::Zero(), o.half}, d);
  const Vector3d outwards = o.shape * d;
  const double scale = std::sqrt(d.dot(outwards));
  // At the centre no farther in than the least semi-axis.
  return scale > 0.0 ? (scale - 1.0) * scale / outwards.norm() : -1.0 / std::sqrt(o.shape.trace());
}

void Resting::From(const world::State& start, double t0) {
  over_ = {t0, 0.0, start, false};
  heights_ = BrakeCurve(start, kBrakeTimes[0]);
  made_beyond_.reset();
  within_.reset();
  touched_.reset();
}

std::optional<Stop> Resting::Brake() {
  if (auto stop = BrakeWithin()) return stop;
  SetProblem(kLongestBrake);
  return goes_beyond_ ? BrakeWithin(false) : std::nullopt;
}

std::optional<Stop> Resting::BrakeWithin(bool heights) {
  beyond_ = !heights;
  for (const double T : kBrakeTimes)
    if (auto stop = Certified(BrakeCurve(over_.start, T), T)) return stop;
  return std::nullopt;
}

std::optional<Stop> Resting::RiseOrBrake() {
  // To rest 0.5 m higher takes 2.9 and 1.0 m/s^2 at most.
  constexpr double kTimes[] = {1.0, 1.7};  // s
  if (!request_.target_body) return Brake();
  const world::Obstacle& target = *request_.target_body;
  beyond_ = false;
  for (const double T : kTimes) {
    Vector3d end = ToPoints(BrakeCurve(over_.start, T), 5).row(5).transpose();
    const double top = target.center.Position(over_.t0 + T).z() + target.half.z() + kAbove;
    const double over = top + HardRadius(config_, request_);
    if (end.z() >= over) break;
    end.z() = over;
    if (auto stop = Certified(CurveTo(over_.start, T, end), T)) return stop;
  }
  return Brake();
}

std::optional<Stop> Resting::StepAside() {
  constexpr double kDistances[] = {0.7, 1.0, 1.4, 1.9, 2.5, 3.2};               // m
  constexpr double kTurns[] = {0.0, M_PI / 4, -M_PI / 4, M_PI / 2, -M_PI / 2};  // rad
  constexpr double kShare = 0.8;  // of the greatest acceleration
  if (!request_.target_body) return std::nullopt;
  const double push = config_.max_acceleration > 0.0 ? kShare * config_.max_acceleration : kPush;
  const Vector3d from = over_.start.p - request_.target_body->center.Position(over_.t0);
  const double away = std::atan2(from.y(), from.x());
  beyond_ = false;
  for (const double r : kDistances) {
    const double T = std::sqrt(10.0 / std::sqrt(3.0) * r / push);  // the quintic's greatest
    const Vector3d end = ToPoints(BrakeCurve(over_.start, T), 5).row(5).transpose();
    for (const double turn : kTurns) {
      const Vector3d place = end + r * Vector3d(std::cos(away + turn), std::sin(away + turn), 0.0);
      if ((place - request_.start.p).norm() > world::kFlightVolume.unseen) continue;
      if (auto stop = Certified(CurveTo(over_.start, T, place), T)) return stop;
    }
  }
  return std::nullopt;
}

std::optional<Stop> Resting::Certified(const Curve& curve, double T) {
  if (!curve.allFinite() || TouchesAgain(curve, T)) return std::nullopt;
  SetProblem(T);
  if (!KeepsLimits(curve, problem_) || !IsForecast(curve, T)) return std::nullopt;
  Refusal refusal;
  auto proofs = ProveOff(curve, problem_, kNoSight, nullptr, &refusal);
  if (!proofs && refusal.tau >= 0.0) {
    const Ellipsoid& e = problem_.obstacles[static_cast<size_t>(refusal.obstacle)];
    if (e.safety_from == 0.0) touched_ = {e.index, refusal.tau, e.safety_radius};
  }
  if (!proofs || (!leaves_ && LeavesListed(*proofs))) return std::nullopt;
  return Stop{{over_.t0, T, curve}, std::move(*proofs), true};
}

bool Resting::TouchesAgain(const Curve& curve, double T) const {
  if (!touched_) return false;
  const world::Obstacle& o = Obstacle(static_cast<size_t>(touched_->obstacle));
  return world::Touch(DroneBall(curve, touched_->radius), nullptr,
                      world::MakeBody(o, over_.t0, T, config_.sigmas), touched_->tau);
}

bool Resting::LeavesListed(const std::vector<Proof>& proofs) const {
  return std::any_of(proofs.begin(), proofs.end(), [&](const Proof& proof) {
    const auto is_it = [&](const world::Obstacle& o) { return o.id == proof.obstacle; };
    return proof.from > 0.0 && std::none_of(besides_.begin(), besides_.end(), is_it);
  });
}

bool Resting::Lasts(const Stop& stop, double t) {
  const world::Trajectory& way = stop.trajectory;
  const double T = t - way.end();
  if (!(T > 0.0)) return true;
  world::State rest;
  rest.p = way.Position(way.end());
  From(rest, way.end());
  return Certified(CurveTo(rest, T, rest.p), T).has_value();
}

bool Resting::CanBeFlown(const Curve& curve, double T) {
  SetProblem(T);
  Problem motion;
  motion.duration = T;
  motion.limits.speed = problem_.limits.speed;
  motion.limits.acceleration = problem_.limits.acceleration;
  return curve.allFinite() && KeepsLimits(curve, motion);
}

std::pair<double, double> Resting::Harm(const Curve& curve, double T) {
  const auto [within, gain] = Within();
  SetProblem(T);
  double contact = HUGE_VAL, least = gain, room_before = 0.0;
  const int n = static_cast<int>(std::ceil(T / kInTime));
  for (int i = 0; i <= n; ++i) {
    const auto [standing, moving] = Clearances(curve, static_cast<double>(i) / n);
    const double room = std::min(standing - within, moving - config_.drone_radius);
    if (i > 0) least = std::min({least, standing, moving});
    if (i > 0 && room < 0.0 && contact == HUGE_VAL)
      contact = T / n * (i - 1 + std::max(0.0, room_before) / (std::max(0.0, room_before) - room));
    room_before = room;
  }
  return {contact, least};
}

const world::Obstacle& Resting::Obstacle(size_t j) const {
  const size_t listed = request_.obstacles.size();
  return j < listed ? request_.obstacles[j] : besides_[j - listed];
}

// Is what moves in curves, the target too, forecast for as long as it could come to the way? Beyond
// its end such a curve is no forecast.
bool Resting::IsForecast(const Curve& way, double T) const {
  constexpr double kRounding = 1e-3, kFast = 3.0;  // s; m/s, a runner
  const Box box = BoxOf(ToPoints(way, 6), 7, 0.0);
  const auto is_forecast = [&](const world::Trajectory& center, const Ellipsoid& e) {
    const double unknown = over_.t0 + T - center.end();
    if (center.degree() < 2 || unknown < kRounding) return true;
    const Curve last = center.Position(center.end()).transpose();
    return !MayTouch(box, last, e.safety_half + kFast * unknown, 1.0);
  };
  for (size_t j = 0; j < problem_.obstacles.size(); ++j)
    if (!is_forecast(Obstacle(j).center, problem_.obstacles[j])) return false;
  return !problem_.target_body || is_forecast(request_.target_body->center, *problem_.target_body);
}

// Of what stands and of what moves.
std::pair<double, double> Resting::Clearances(const Curve& curve, double tau) const {
  const Vector3d p = planning::Evaluate(curve, tau);
  const Limits& l = problem_.limits;
  double standing = HUGE_VAL, moving = HUGE_VAL;
  for (size_t j = 0; j < problem_.obstacles.size(); ++j) {
    const Curve& center = problem_.obstacles[j].center;
    double& least = center.bottomRows(center.rows() - 1).isZero() ? standing : moving;
    least = std::min(least, DistanceTo(Obstacle(j), p - planning::Evaluate(center, tau)));
  }
  if (problem_.target_body)
    moving =
        std::min(moving, DistanceTo(*request_.target_body,
                                    p - planning::Evaluate(problem_.target_body->center, tau)));
  if (!l.height) return {standing, moving};
  const double above = l.ground.Above(p);
  return {std::min({standing, above, config_.drone_radius + l.z_max - above}), moving};
}

// Clearance of what stands below which it is a contact, and the most of it that counts.
std::pair<double, double> Resting::Within() {
  if (within_) return *within_;
  SetProblem(kBrakeTimes[0]);
  within_ = {config_.drone_radius, HUGE_VAL};
  if (Clearances(heights_, 0.0).first >= config_.drone_radius) return *within_;
  double least = HUGE_VAL;
  for (double tau = 0.0; tau <= 1.0; tau += kInTime)
    least = std::min(least, Clearances(heights_, tau).first);
  within_ = {least - kAlike, least - kAlike};
  return *within_;
}

void Resting::SetProblem(double T) {
  if (problem_.duration == T && made_beyond_ == beyond_) return;
  made_beyond_ = beyond_;
  over_.horizon = T;
  MakeProblem(config_, request_, over_, nullptr, &problem_, besides_);
  for (Ellipsoid& e : problem_.obstacles)
    if (e.safety_from > 0.0 && e.ground) e.safety_from = kOutBy;
  Limits& l = problem_.limits;
  l.tan_elevation = l.min_distance = 0.0;
  // Braking may leave the heights as far as the quickest way of it must.
  const Points points = ToPoints(heights_, 5);
  const Limits within = l;
  for (int i = 0; i <= 5; ++i) {
    const double z = l.ground.Above(points.row(i).transpose());
    l.z_min = std::min(l.z_min, z - 1e-6);
    l.z_max = std::max(l.z_max, z + 1e-6);
  }
  goes_beyond_ = l.z_min < within.z_min || l.z_max > within.z_max;
  if (!beyond_) l = within;
}

}  // namespace chase::planning
