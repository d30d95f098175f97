#include "services/planning/stopping.h"

#include <algorithm>
#include <cmath>

#include "common/world/shapes.h"
#include "services/planning/candidate_set.h"
#include "services/planning/limits.h"
#include "services/planning/separations.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr double kTimes[] = {0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0};  // s, of a braking
constexpr double kInTime = 0.05;  // s: contacts are sampled this often
constexpr double kAlike = 0.01;   // m of clearance that make no difference
// tau by which the ground is left: from rest to rest a climb of 0.5 m is 0.27 m up by then, and
// slabs reach 0.3 m above what they stand for. The check allows as much: kLeaveGroundBy.
constexpr double kOutBy = 0.6;

/// Coefficients in Bernstein form of degree n that continue position, velocity, acceleration and
/// jerk of s over T; the rest are zero.
Points Continued(const world::State& s, double T, int n) {
  Points b = Points::Zero();
  const Vector3d d[4] = {s.p, T * s.v, T * T * s.a, T * T * T * s.j};
  const double falling[4] = {1.0, 1.0 * n, n * (n - 1.0), n * (n - 1.0) * (n - 2.0)};
  // Differences of order k at the start are d_k / falling_k.
  Vector3d difference[4];
  for (int k = 0; k < 4; ++k) difference[k] = d[k] / falling[k];
  for (int i = 0; i < 4; ++i) {
    Vector3d sum = Vector3d::Zero();
    double binomial = 1.0;
    for (int k = 0; k <= i; ++k) {
      sum += binomial * difference[k];
      binomial *= (i - k) / (k + 1.0);
    }
    b.row(i) = sum.transpose();
  }
  return b;
}

Curve BrakeCurve(const world::State& s, double T) {
  Points b = Continued(s, T, 5);
  b.row(4) = b.row(5) = b.row(3);
  return ToPower(b, 5);
}

/// To rest at `end`.
Curve CurveTo(const world::State& s, double T, const Vector3d& end) {
  Points b = Continued(s, T, 6);
  for (int i = 4; i <= 6; ++i) b.row(i) = end.transpose();
  return ToPower(b, 6);
}

/// Distance of a point, `d` from its centre, to the solid; of an ellipsoid to first order (Taubin
/// 1991, eq. 3).
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

/// Comes to rest from the request's start, or from other states; sight is not asked for.
class Resting {
 public:
  Resting(const PlannerConfig& config, const PlanRequest& request,
          const std::vector<world::Obstacle>& besides = {}, Problem* memory = nullptr)
      : config_(config), request_(request), besides_(besides), problem_(memory ? *memory : own_) {
    From(request.start, request.t0);
  }
  Resting(const Resting&) = delete;  // problem_ may be its own

  void From(const world::State& start, double t0) {
    over_ = {t0, 0.0, start, false};
    heights_ = BrakeCurve(start, kTimes[0]);
    has_problem_ = false;
    within_.reset();
  }

  /// Within the heights, or else as far beyond as the quickest way must.
  std::optional<Stop> Brake() {
    auto stop = BrakeWithin();
    return stop || !goes_beyond_ ? stop : BrakeWithin(false);
  }
  std::optional<Stop> BrakeWithin(bool heights = true) {
    beyond_ = !heights;
    has_problem_ = false;
    for (const double T : kTimes)
      if (auto stop = Certified(BrakeCurve(over_.start, T), T)) return stop;
    return std::nullopt;
  }

  /// A certified way over T, if the curve is one.
  std::optional<Stop> Certified(const Curve& curve, double T) {
    SetProblem(T);
    if (!curve.allFinite() || !KeepsLimits(curve, problem_) || !IsForecast(curve, T))
      return std::nullopt;
    auto proofs = ProveOff(curve, problem_, 1.0);
    if (!proofs) return std::nullopt;
    return Stop{{over_.t0, T, curve}, std::move(*proofs), true};
  }

  /// Within the limits of speed and acceleration.
  bool CanBeFlown(const Curve& curve, double T) {
    SetProblem(T);
    Problem motion;
    motion.duration = T;
    motion.limits.speed = problem_.limits.speed;
    motion.limits.acceleration = problem_.limits.acceleration;
    motion.target = problem_.target;
    return curve.allFinite() && KeepsLimits(curve, motion);
  }

  /// Time of the first contact, s, interpolated between samples, infinite where there is none, and
  /// the least clearance. The ground and the greatest height count as an obstacle's surface. Where
  /// the map has a static obstacle at the start it is wrong, as the body is there: going as far in
  /// as the quickest braking is no contact with it, and to flee it is no gain.
  std::pair<double, double> Harm(const Curve& curve, double T) {
    const auto [within, gain] = Within();
    SetProblem(T);
    double contact = HUGE_VAL, least = gain, room_before = 0.0;
    const int n = static_cast<int>(std::ceil(T / kInTime));
    for (int i = 0; i <= n; ++i) {
      const auto [standing, moving] = Clearances(curve, static_cast<double>(i) / n);
      const double room = std::min(standing - within, moving - config_.drone_radius);
      if (i > 0) least = std::min({least, standing, moving});
      if (i > 0 && room < 0.0 && contact == HUGE_VAL)
        contact =
            T / n * (i - 1 + std::max(0.0, room_before) / (std::max(0.0, room_before) - room));
      room_before = room;
    }
    return {contact, least};
  }

 private:
  const world::Obstacle& Obstacle(size_t j) const {
    const size_t listed = request_.obstacles.size();
    return j < listed ? request_.obstacles[j] : besides_[j - listed];
  }

  /// Is what moves in curves forecast for as long as it could come to the way? Beyond its end such
  /// a curve is no forecast.
  bool IsForecast(const Curve& way, double T) const {
    constexpr double kRounding = 1e-3, kFast = 2.0;  // s; m/s
    const Box box = BoxOf(ToPoints(way, 6), 7, 0.0);
    for (size_t j = 0; j < problem_.obstacles.size(); ++j) {
      const world::Trajectory& center = Obstacle(j).center;
      const double unknown = over_.t0 + T - center.end();
      if (center.degree() < 2 || unknown < kRounding) continue;
      const Curve last = center.Position(center.end()).transpose();
      if (MayTouch(box, last, problem_.obstacles[j].safety_half + kFast * unknown, 1.0))
        return false;
    }
    return true;
  }

  /// Of what stands and of what moves.
  std::pair<double, double> Clearances(const Curve& curve, double tau) const {
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

  /// Clearance of what stands below which it is a contact, and the most of it that counts.
  std::pair<double, double> Within() {
    if (within_) return *within_;
    SetProblem(kTimes[0]);
    within_ = {config_.drone_radius, HUGE_VAL};
    if (Clearances(heights_, 0.0).first >= config_.drone_radius) return *within_;
    double least = HUGE_VAL;
    for (double tau = 0.0; tau <= 1.0; tau += kInTime)
      least = std::min(least, Clearances(heights_, tau).first);
    within_ = {least - kAlike, least - kAlike};
    return *within_;
  }

  void SetProblem(double T) {
    if (problem_.duration == T && has_problem_) return;
    has_problem_ = true;
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

  const PlannerConfig& config_;
  const PlanRequest& request_;
  const std::vector<world::Obstacle> besides_;
  Stretch over_;
  Problem own_;
  Problem& problem_;
  Curve heights_;
  bool has_problem_ = false;
  bool beyond_ = true, goes_beyond_ = false;  ///< the heights: may it, and would the quickest way
  std::optional<std::pair<double, double>> within_;
};

/// Displacements of the place of rest by distance: none, then rings of directions, level, up and
/// down.
std::vector<Vector3d> Displacements() {
  constexpr int kAround = 12;
  std::vector<Vector3d> all;
  for (const double r : {0.4, 0.8, 1.4, 2.2})
    for (const double rise : {0.0, 0.5, -0.5})
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2.0 * M_PI * i / kAround;
        all.emplace_back(r * std::cos(angle), r * std::sin(angle), rise * r);
      }
  for (const double rise : {0.5, -0.5, 1.0, -1.0}) all.emplace_back(0.0, 0.0, rise);
  std::stable_sort(all.begin(), all.end(), [](const Vector3d& a, const Vector3d& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  return all;
}

PlannerConfig WithoutMargin(PlannerConfig config) {
  config.safety_margin = 0.0;
  return config;
}

/// What is unseen but for the places that the start is in: the body is there.
std::vector<world::Obstacle> UnseenAround(const PlannerConfig& config, const PlanRequest& request) {
  std::vector<world::Obstacle> unseen;
  for (const world::Obstacle& o : request.unseen)
    if (DistanceTo(o, request.start.p - o.center.Position(request.t0)) > config.hard_radius())
      unseen.push_back(o);
  return unseen;
}

/// Does the plan keep off all of them until t, and off the target's body where its own proof counts
/// on its being left before that?
bool KeepsOff(const PlannerConfig& config, const PlanRequest& request,
              const std::vector<world::Obstacle>& unseen, const world::Trajectory& plan, double t) {
  const bool late = request.target_body && t > plan.start + kOverdue;
  if ((unseen.empty() && !late) || t <= plan.start) return true;
  PlanRequest part;
  static_cast<Stretch&>(part) = {plan.start, t - plan.start, request.start, false};
  part.target = request.target;
  part.obstacles = unseen;
  if (late) {
    part.target_body = request.target_body;
    part.target_manoeuvre = request.target_manoeuvre;
  }
  return StaysOff(ToCurve(plan, part.t0, part.horizon), MakeProblem(config, part, nullptr), 1.0);
}

}  // namespace

std::optional<Stop> Brake(const PlannerConfig& config, const PlanRequest& request) {
  return Resting(config, request).Brake();
}

std::optional<Stop> GoTo(const PlannerConfig& config, const PlanRequest& request,
                         const Vector3d& end) {
  // Rest to rest the speed peaks at 2.2 times the mean, which stays below 4 m/s of max_speed, and
  // the acceleration of the shortest way at 5 m/s^2.
  constexpr double kPace = 1.0, kLeast = 1.5;  // m/s, s
  const double quickest = std::max(kLeast, (end - request.start.p).norm() / kPace);
  Resting resting(config, request);
  for (const double slower : {1.0, 1.5, 2.2}) {
    const double T = slower * quickest;
    if (auto stop = resting.Certified(CurveTo(request.start, T, end), T)) return stop;
  }
  return std::nullopt;
}

std::optional<Stop> GoOn(const PlannerConfig& config, const PlanRequest& request,
                         const world::Trajectory& way) {
  constexpr double kLeast = 0.1;  // s
  const double T = way.end() - request.t0;
  if (T < kLeast || request.t0 < way.start) return std::nullopt;
  Resting resting(config, request);
  return resting.Certified(ToCurve(way, request.t0, T), T);
}

namespace {

// The way that was committed to with the running plan: what is left of that plan until its stop,
// and the stop, where they still hold without a margin.
std::optional<PlanResult> Committed(const PlannerConfig& config, const PlanRequest& request) {
  if (!request.stop) return std::nullopt;
  PlanResult result;
  if (request.t0 >= request.stop->start) {
    auto stop = GoOn(config, request, *request.stop);
    if (!stop) return std::nullopt;
    result.verdict = LeavesObstacles(stop->proofs) ? Verdict::kEscape : Verdict::kBrake;
    result.reason = "on the stop of the plan before";
    result.trajectory = std::move(stop->trajectory);
    SetProofs(config, request, std::move(stop->proofs), &result);
    return result;
  }
  if (!request.running || request.stop->start > request.running->end()) return std::nullopt;
  const double T = request.stop->start - request.t0;
  Resting resting(config, request);
  auto rest = resting.Certified(ToCurve(*request.running, request.t0, T), T);
  if (!rest) return std::nullopt;
  resting.From(request.running->At(request.stop->start), request.stop->start);
  auto stop = resting.Certified(ToCurve(*request.stop, request.stop->start, request.stop->duration),
                                request.stop->duration);
  if (!stop) return std::nullopt;
  result.verdict = LeavesObstacles(rest->proofs) || LeavesObstacles(stop->proofs)
                       ? Verdict::kEscape
                       : Verdict::kSafeOnly;
  result.reason = "the running plan until its stop";
  result.trajectory = std::move(rest->trajectory);
  SetProofs(config, request, std::move(rest->proofs), &result);
  result.stop = std::move(stop->trajectory);
  result.stop_proofs = std::move(stop->proofs);
  return result;
}

}  // namespace

Stop Evade(const PlannerConfig& config, const PlanRequest& request) {
  static const std::vector<Vector3d> displacements = Displacements();
  constexpr double kOver[] = {1.0, 1.6};
  const std::vector<world::Obstacle> unseen = UnseenAround(config, request);
  Resting resting[] = {{config, request}, {config, request}};
  Resting seen[] = {{config, request, unseen}, {config, request, unseen}};
  std::optional<Stop> blind;  // certified but for what nobody has looked into
  Stop best;
  std::pair<double, double> least{-HUGE_VAL, -HUGE_VAL};
  const auto weigh = [&](Resting* way, const Curve& curve, double T) {
    if (!curve.allFinite()) return;
    const std::pair<double, double> harm = way->Harm(curve, T);
    if (harm <= least) return;
    least = harm;
    best.trajectory = {request.t0, T, curve};
  };
  constexpr double kLongest = kTimes[4];
  Resting braking(config, request);
  for (const double T : {kTimes[0], kTimes[2], kLongest}) {
    const Curve curve = BrakeCurve(request.start, T);
    if (braking.CanBeFlown(curve, T)) weigh(&braking, curve, T);
  }
  for (const Vector3d& d : displacements)
    for (int i = 0; i < 2; ++i) {
      const double T = kOver[i];
      const Vector3d end = ToPoints(BrakeCurve(request.start, T), 5).row(5).transpose() + d;
      const Curve curve = CurveTo(request.start, T, end);
      if (auto stop = resting[i].Certified(curve, T)) {
        if (unseen.empty() || seen[i].Certified(curve, T)) return *stop;
        if (!blind) blind = std::move(stop);
        continue;
      }
      if (!blind && resting[i].CanBeFlown(curve, T)) weigh(&resting[i], curve, T);
    }
  if (blind) return *blind;
  if (least.first < 0.0)  // none can be flown
    weigh(&braking, BrakeCurve(request.start, kLongest), kLongest);
  if (least.first < 0.0)  // none is finite
    best.trajectory = world::Trajectory::Constant(request.start.p, request.t0, 1.0);
  return best;
}

void SetProofs(const PlannerConfig& config, const PlanRequest& request, std::vector<Proof> proofs,
               PlanResult* result) {
  const Ground ground = GroundOf(request.obstacles);
  const Points points = ToPoints(Curve(result->trajectory.coefficients), 6);
  double least = HUGE_VAL;
  for (int i = 0; i <= 6; ++i) least = std::min(least, ground.Above(points.row(i).transpose()));
  for (const Proof& p : proofs)
    if (!p.of_sight) least = std::min(least, p.from > 0.0 ? 0.0 : p.radius + p.room);
  result->certified_clearance = std::max(0.0, least - config.hard_radius());
  result->proofs = std::move(proofs);
}

bool LeavesObstacles(const std::vector<Proof>& proofs) {
  return std::any_of(proofs.begin(), proofs.end(), [](const Proof& p) { return p.from > 0.0; });
}

PlanResult RestPlan(const PlannerConfig& config, const PlanRequest& request) {
  const PlannerConfig hard = WithoutMargin(config);
  PlanResult result;
  Resting wide(config, request), close(hard, request);
  std::optional<Stop> stop = wide.BrakeWithin();
  if (!stop) stop = close.BrakeWithin();
  if (!stop)
    if (auto committed = Committed(hard, request)) return *committed;
  if (!stop) stop = wide.Brake();
  if (!stop) stop = close.Brake();
  result.verdict = Verdict::kBrake;
  if (!stop) {
    stop = Evade(config, request);
    if (stop->certified) result.verdict = Verdict::kEscape;
    result.reason = stop->certified ? "nor is braking" : "nor is braking, nor any way aside";
  }
  if (LeavesObstacles(stop->proofs)) result.verdict = Verdict::kEscape;
  result.trajectory = std::move(stop->trajectory);
  if (stop->certified) SetProofs(config, request, std::move(stop->proofs), &result);
  return result;
}

std::optional<Stop> WayOut(const PlannerConfig& config, const PlanRequest& request,
                           const world::Trajectory& plan, Problem* memory) {
  const PlannerConfig hard = WithoutMargin(config);
  const std::vector<world::Obstacle> unseen = UnseenAround(hard, request);
  const auto is_unseen = [&](const Proof& proof) {
    return std::any_of(unseen.begin(), unseen.end(),
                       [&](const auto& o) { return o.id == proof.obstacle; });
  };
  Resting resting(hard, request, unseen, memory);
  for (const double after : {kOverdue, 0.2, 0.7, 1.1, HUGE_VAL}) {
    const double t = std::min(plan.start + after, plan.end());
    resting.From(plan.At(t), t);
    std::optional<Stop> stop;
    if (KeepsOff(hard, request, unseen, plan, t)) stop = resting.Brake();
    if (stop) {  // whoever checks it hears of obstacles only
      auto& proofs = stop->proofs;
      proofs.erase(std::remove_if(proofs.begin(), proofs.end(), is_unseen), proofs.end());
      return stop;
    }
    if (t == plan.end()) break;
  }
  return std::nullopt;
}

}  // namespace chase::planning
