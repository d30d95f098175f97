#include "services/planning/problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"
#include "services/planning/field_of_view.h"
#include "services/planning/separations.h"

namespace chase::planning {
namespace {

// Margins are taken back in these shares until the start, the target, or the line of sight at the
// start is outside the shape.
constexpr double kShares[] = {1.0, 0.75, 0.5, 0.25, 0.0};
constexpr double kClear = 1.02;       // squared distance; as a factor of lengths more than enough
constexpr double kPoint = 1e6;        // 1/m^2, of a shape that sorts out nothing
constexpr double kLeaveBy = 0.25;     // tau by which a plan has left an obstacle that it starts in
constexpr double kBackInView = 0.25;  // tau by which a plan sees a target that it starts without

double SquaredNorm(const Eigen::Matrix3d& R, const Eigen::Vector3d& x) { return x.dot(R * x); }

// Deviations of the obstacle's position along the worst axis, times sigmas, at tau.
double Uncertainty(const world::Obstacle& o, const Problem& problem, double tau) {
  if (o.position_covariance.isZero(0.0) && o.velocity_covariance.isZero(0.0)) return 0.0;
  const double age = problem.t0 + tau * problem.duration - o.center.start;
  const Eigen::Vector3d variance =
      o.position_covariance.diagonal() + age * age * o.velocity_covariance.diagonal();
  return problem.sigmas * std::sqrt(std::max(0.0, variance.maxCoeff()));
}

constexpr int kSamples = 24;

// A curve and boxes around it and its quarters, where its degree allows them.
struct Hull {
  static constexpr int kQuarters = 4;
  const Curve& curve;
  bool has_boxes;
  Box whole, quarters[kQuarters];

  explicit Hull(const Curve& curve_) : curve(curve_), has_boxes(curve.rows() <= 7) {
    whole = {Eigen::Array3d::Constant(-HUGE_VAL), Eigen::Array3d::Constant(HUGE_VAL)};
    if (!has_boxes) return;
    Points left = ToPoints(curve, 6);
    whole = BoxOf(left, 7, 1e-6);
    Points right = Halve(&left);
    for (int a = 0; a < 2; ++a) {
      Points* half = a == 0 ? &left : &right;
      const Points later = Halve(half);
      quarters[2 * a] = BoxOf(*half, 7, 1e-6);
      quarters[2 * a + 1] = BoxOf(later, 7, 1e-6);
    }
  }

 private:
  // Leaves the first half and returns the second.
  static Points Halve(Points* points) {
    Points right = *points;
    for (int a = 0; a < 3; ++a)
      for (int k = 1; k < 7; ++k) {
        for (int i = 0; i + k < 7; ++i) right(i, a) = 0.5 * (right(i, a) + right(i + 1, a));
        (*points)(k, a) = right(0, a);
      }
    return right;
  }
};

// A quick sufficient test that the curve stays well out.
bool IsPlainlyOutside(const Hull& curve, const Curve& center, const Eigen::Array3d& half) {
  if (!curve.has_boxes) return false;
  if (!MayTouch(curve.whole, center, half, kClear)) return true;
  for (const Box& box : curve.quarters)
    if (MayTouch(box, center, half, kClear)) return false;
  return true;
}

bool StaysOutside(const Curve& curve, const Curve& center, const Eigen::Matrix3d& R, double limit) {
  for (int i = 0; i <= kSamples; ++i) {
    const double tau = static_cast<double>(i) / kSamples;
    if (SquaredNorm(R, Evaluate(curve, tau) - Evaluate(center, tau)) <= limit) return false;
  }
  return true;
}

void Note(std::string* notes, const std::string& text) {
  if (!notes) return;
  if (!notes->empty()) *notes += "; ";
  *notes += text;
}

// The line of sight at the start and a box around it.
struct FirstSight {
  Eigen::Vector3d p, q;
  Box box;

  explicit FirstSight(const Problem& problem)
      : p(problem.start.row(0).transpose()), q(problem.target.row(0).transpose()) {
    box = {p.array().min(q.array()) - 1e-6, p.array().max(q.array()) + 1e-6};
  }
  bool IsBeyond(const Curve& center, const Eigen::Matrix3d& R, const Eigen::Array3d& half,
                double limit) const {
    const Curve first = center.topRows(1);
    return !MayTouch(box, first, half, limit) ||
           world::SegmentSquaredDistance(p, q, center.row(0).transpose(), R) > limit;
  }
};

// What the ellipsoids are grown by, m.
struct Growth {
  double safety, sight;
};

// Boxes around the Minkowski sums: half the sides of the solid's, and what it is grown by at most.
void SetBoxes(const world::Obstacle& o, const Growth& most, Ellipsoid* e) {
  Eigen::Array3d half = o.half.array();
  if (o.solid == world::Obstacle::Solid::kBox)
    half = (o.axes.toRotationMatrix().cwiseAbs() * o.half).array();
  else if (o.solid == world::Obstacle::Solid::kEllipsoid)
    half = HalfSidesOf(o.shape);
  e->safety_half = half + most.safety;
  e->sight_half = half + most.sight;
}

// What depends on the shape alone is kept where the obstacle is what it was. Without a search
// nothing has to be grown that has a body.
void SetShapes(const PlannerConfig& config, const PlanRequest& request, const world::Obstacle& o,
               const Growth& growth, Ellipsoid* e) {
  const bool same = IsSameShape(e->grown_from, o.shape);
  e->grown_from = o.shape;
  if (!config.minkowski_sums)
    e->body.reset();
  else if (same && e->body && e->body->kind == o.solid && o.solid == world::Body::Kind::kEllipsoid)
    world::Retime(o, request.t0, request.horizon, config.sigmas, &*e->body);
  else
    e->body = world::MakeBody(o, request.t0, request.horizon, config.sigmas);
  if (o.ground) {  // heights sort out candidates; no ellipsoid fits a slab
    e->safety = e->sight = kPoint * Eigen::Matrix3d::Identity();
    e->grown_by[0] = -1.0;
    return;
  }
  if (!request.asks_sight && e->body) {
    e->grown_by[0] = -1.0;
    return;
  }
  if (same && e->grown_by[0] == growth.safety && e->grown_by[1] == growth.sight) return;
  e->safety = e->sight = o.shape;
  if (growth.safety > 0.0 || growth.sight > 0.0) {
    const world::Inflation inflation(o.shape);
    if (growth.safety > 0.0) e->safety = inflation.By(growth.safety);
    if (growth.sight > 0.0) e->sight = inflation.By(growth.sight);
  }
  e->grown_by[0] = growth.safety;
  e->grown_by[1] = growth.sight;
}

Eigen::Matrix3d Grown(const world::Obstacle& o, double margin) {
  return margin > 0.0 ? world::Inflated(o.shape, margin) : o.shape;
}

// Margins that give way at the start: whether what stands at tau = 0 is off the obstacle.
class Start {
 public:
  explicit Start(const Problem& problem) : problem_(problem) {
    start_.center = problem.start.topRows(1);
    seen_.center = problem.target.topRows(1);
  }
  bool IsSafe(const Ellipsoid& e, double radius) {
    if (!e.body) {
      const Eigen::Vector3d offset = (problem_.start.row(0) - e.center.row(0)).transpose();
      return SquaredNorm(e.safety, offset) > 1.0;
    }
    start_.radius = math::Polynomial::Constant(1, radius);
    return IsOff(e, nullptr);
  }
  const Curve& curve() const { return problem_.start; }
  bool IsInSight(const Ellipsoid& e, double share) {
    start_.radius = math::Polynomial::Constant(1, share * problem_.sight_radius);
    seen_.radius = TargetBall(problem_, share).radius.head(1);
    return IsOff(e, &seen_);
  }

 private:
  // Off by a little more than nothing, so that a plan can be, too.
  bool IsOff(const Ellipsoid& e, const world::Ball* target) {
    world::Body body = *e.body;
    body.center = body.center.topRows(1).eval();
    body.covariance[1].setZero();
    body.covariance[2].setZero();
    start_.radius[0] += kRounding;
    return world::Separate(start_, target, body).kept == world::Kept::kOff;
  }
  static constexpr double kRounding = 1e-4;  // m
  const Problem& problem_;
  world::Ball start_, seen_;
};

// The ellipsoid only sorts candidates out before the proof looks at the solid. Where it holds a
// start that is off the solid, none would be left: there it is smaller, or sorts out nothing.
void ClearStart(const world::Obstacle& o, double growth, const Curve& start, Ellipsoid* e) {
  const Eigen::Vector3d offset = (start.row(0) - e->center.row(0)).transpose();
  for (const double share : {1.0, 0.5, 0.0}) {
    if (share < 1.0) {
      e->safety = Grown(o, share * growth);
      e->grown_by[0] = -1.0;
    }
    if (SquaredNorm(e->safety, offset) > kClear) return;
  }
  e->safety = kPoint * Eigen::Matrix3d::Identity();
}

// Takes the margin, never the hard radius, back until the start is outside.
void RelaxSafety(const world::Obstacle& o, double hard, double margin, double uncertainty,
                 bool searched, Start* start, Ellipsoid* e, std::string* notes) {
  for (double share : kShares) {
    e->safety_radius = hard + share * margin;
    if (share < 1.0 && searched) {
      e->safety = Grown(o, e->safety_radius + uncertainty);
      e->grown_by[0] = -1.0;
    }
    if (!start->IsSafe(*e, e->safety_radius)) continue;
    if (share < 1.0) Note(notes, "starts within the margin of obstacle " + std::to_string(e->id));
    if (e->body && searched) ClearStart(o, e->safety_radius + uncertainty, start->curve(), e);
    return;
  }
  e->safety_from = kLeaveBy;
  Note(notes, "starts inside obstacle " + std::to_string(e->id));
}

// The largest share of the margin that the target keeps out of, and the line of sight at the start
// too, where it keeps out of any.
void RelaxSight(const world::Obstacle& o, const Growth& growth, const FirstSight& first,
                const Hull& target, const Problem& problem, Start* start, Ellipsoid* e,
                std::string* notes) {
  const auto target_is_off = [&](double share) {
    if (IsPlainlyOutside(target, e->center, e->sight_half)) return true;
    if (!e->body)
      return StaysOutside(target.curve, e->center, e->sight, share > 0.0 ? kClear : 1.0);
    return world::Separate(TargetBall(problem, share), nullptr, *e->body).kept == world::Kept::kOff;
  };
  const auto begins_in_sight = [&](double share) {
    if (!first.IsBeyond(e->center, e->sight, e->sight_half, share > 0.0 ? kClear : 1.0))
      return false;
    return !e->body || start->IsInSight(*e, share);
  };
  double kept = -1.0;
  const auto take = [&](double share) {
    e->sight_share = share;
    e->sight = Grown(o, share * growth.sight);
    e->grown_by[1] = -1.0;
  };
  for (double share : kShares) {
    if (share < 1.0) take(share);
    if (!target_is_off(share)) continue;
    if (kept < 0.0) kept = share;
    if (!begins_in_sight(share)) continue;
    if (share < kept)
      Note(notes, "sight starts within the margin of obstacle " + std::to_string(e->id));
    else if (share < 1.0)
      Note(notes, "the target passes within the sight margin of obstacle " + std::to_string(e->id));
    return;
  }
  if (kept >= 0.0) {
    if (kept < 1.0)
      Note(notes, "the target passes within the sight margin of obstacle " + std::to_string(e->id));
    return take(kept);
  }
  e->sight_from = 1.0;
  Note(notes, "obstacle " + std::to_string(e->id) + " holds the target, its shadow is ignored");
}

// How far a motion with speed v and acceleration a goes on that `brake` slows down after a moment.
double Overshoot(double v, double a, double brake) {
  constexpr double kMoment = 0.2;  // s
  const double then = v + kMoment * std::max(0.0, a);
  return then > 0.0 ? std::max(0.0, v) * kMoment + then * then / (2.0 * brake) : 0.0;
}

// Limits that the start already breaks give way to what it has: no chain of plans gets worse.
// Heights give way to what the start cannot help only, so that none sinks. What is below the drone
// its LiDAR sees on the way there only: it comes down along that slope, or slowly, until it is
// level with people.
Limits MakeLimits(const PlannerConfig& c, const world::State& s, const Eigen::Vector3d& target,
                  const Ground& ground, double horizon) {
  constexpr double kRounding = 1e-6, kBrake = 2.0;  // m; m/s^2 where no limit is set
  constexpr double kOverhead = 10.0;                // tangent from which there is no side to be on
  constexpr double kUnseenDrop = 0.15;              // m: replanned, half a metre a second
  constexpr double kSightSlope = 0.2;               // 15 degrees, less a tilt of 4
  constexpr double kPerson = 1.7;                   // m high
  const auto at_least = [](double limit, double now) {
    return limit > 0.0 ? std::max(limit, (1.0 + kRounding) * now + kRounding) : 0.0;
  };
  Limits limits;
  limits.speed = at_least(c.max_speed, s.v.norm());
  limits.acceleration = at_least(c.max_acceleration, s.a.norm());
  limits.height = c.z_max > c.z_min;
  const double brake = c.max_acceleration > 0.0 ? 0.5 * c.max_acceleration : kBrake;
  const double v = ground.Rise(s.v), a = ground.Rise(s.a), z = ground.Above(s.p);
  limits.ground = ground;
  const double seen_to = z - kUnseenDrop - kSightSlope * s.v.head<2>().norm() * horizon;
  const double lowest = seen_to > kPerson ? std::max(c.z_min, seen_to) : c.z_min;
  limits.z_min = std::min(lowest, z - Overshoot(-v, -a, brake) - kRounding);
  limits.z_max = std::max(c.z_max, z + Overshoot(v, a, brake) + kRounding);
  const Eigen::Vector3d r = target - s.p;
  const double tangent = std::tan(c.max_elevation_deg * M_PI / 180.0);
  const double now = std::abs(r.z()) / std::max(r.head<2>().norm(), 1e-3);
  limits.tan_elevation = now < kOverhead ? at_least(tangent, now) : 0.0;
  limits.min_distance = std::min(c.min_distance, 0.9 * r.norm());
  limits.view = c.view();
  const double below = SeenAt(r, s.a, nullptr).x();
  const bool seen = limits.view && below < limits.view->down && below > -limits.view->up;
  limits.view_from = seen ? 0.0 : kBackInView;
  return limits;
}

Curve StartCurve(const world::State& s, double T) {
  Curve c(4, 3);
  c.row(0) = s.p.transpose();
  c.row(1) = T * s.v.transpose();
  c.row(2) = T * T / 2.0 * s.a.transpose();
  c.row(3) = T * T * T / 6.0 * s.j.transpose();
  return c;
}

// The target's own body, to which no margin is kept.
void SetTargetBody(const world::Obstacle& o, double hard, Start* start, Problem* problem,
                   std::string* notes) {
  Ellipsoid e;
  e.id = kTargetId;
  e.body = world::MakeBody(o, problem->t0, problem->duration, problem->sigmas);
  e.center = ToCurve(o.center, problem->t0, problem->duration);
  e.grown_from = o.shape;
  e.sight_from = 1.0;
  e.safety_radius = hard;
  const double most = std::max(Uncertainty(o, *problem, 0.0), Uncertainty(o, *problem, 1.0));
  SetBoxes(o, {hard + most, 0.0}, &e);
  if (!start->IsSafe(e, hard)) {
    e.safety_from = kLeaveBy;
    Note(notes, "starts at the target");
  }
  problem->target_body = e;
}

// A chord over the deviation, which is convex in tau.
math::Polynomial TargetGrowth(const PlannerConfig& config, const PlanRequest& request) {
  const double now = config.sigmas * request.target_sigma;
  const double then = config.sigmas * std::hypot(request.target_sigma,
                                                 request.target_speed_sigma * request.horizon);
  math::Polynomial growth(2);
  growth << now, then - now;
  return growth;
}

}  // namespace

Ground GroundOf(const std::vector<world::Obstacle>& obstacles) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const world::Obstacle& o : obstacles) {
    if (!o.ground) continue;
    const double area = o.half.x() * o.half.y();
    const Eigen::Vector3d center = o.center.Position(o.center.start);
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) {
        const Eigen::Vector3d p =
            center + o.axes * Eigen::Vector3d(x * o.half.x(), y * o.half.y(), 0.0);
        const Eigen::Vector3d row(p.x(), p.y(), 1.0);
        A += area * row * row.transpose();
        b += area * p.z() * row;
      }
  }
  if (A.isZero(0.0)) return {};
  const Eigen::Vector3d plane = A.ldlt().solve(b);
  return {plane.x(), plane.y(), plane.z()};
}

int Problem::n_candidates() const {
  int n = 1;
  for (const auto& choices : skeletons) n *= static_cast<int>(choices.size());
  return n;
}

void MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes,
                 Problem* problem) {
  problem->t0 = request.t0;
  problem->duration = request.horizon;
  problem->degree = config.degree;
  problem->start = StartCurve(request.start, request.horizon);
  problem->target = ToCurve(request.target, request.t0, request.horizon);
  problem->limits = MakeLimits(config, request.start, problem->target.row(0).transpose(),
                               GroundOf(request.obstacles), request.horizon);
  problem->skeletons.clear();
  problem->reach.reset();
  problem->obstacles.resize(request.obstacles.size());
  problem->sigmas = config.sigmas;
  problem->sight_radius = config.sight_margin;
  problem->target_growth = TargetGrowth(config, request);
  const double sight = config.sight_margin + 0.5 * problem->target_growth.sum();
  const double hard = config.hard_radius(), margin = config.safety_margin;
  const Hull target(problem->target);
  const FirstSight first(*problem);
  Start start(*problem);
  const Box own{target.whole.low.min(first.box.low), target.whole.high.max(first.box.high)};
  for (size_t j = 0; j < request.obstacles.size(); ++j) {
    const world::Obstacle& o = request.obstacles[j];
    Ellipsoid* e = &problem->obstacles[j];
    e->id = o.id;
    e->safety_from = 0.0;
    const bool asks_sight = request.asks_sight && !o.ground;
    e->ground = o.ground;
    e->sight_from = asks_sight ? 0.0 : 1.0;
    e->sight_share = 1.0;
    e->safety_radius = hard + margin;
    world::SetCurve(o.center, request.t0, request.horizon, &e->center);
    const double then = Uncertainty(o, *problem, 1.0), now = Uncertainty(o, *problem, 0.0);
    const Growth growth{hard + margin + 0.5 * (now + then), sight + 0.5 * (now + then)};
    SetShapes(config, request, o, growth, e);
    const double most = std::max(now, then);
    const Growth widest{hard + margin + most,
                        config.sight_margin + problem->target_growth.sum() + most};
    SetBoxes(o, widest, e);
    const bool searched = !o.ground && (request.asks_sight || !e->body);
    if (e->body && searched) ClearStart(o, growth.safety, problem->start, e);
    // Far from start and target no margin has to give way.
    if (!MayTouch(own, e->center, e->safety_half.max(e->sight_half), kClear)) continue;
    RelaxSafety(o, hard, margin, now, searched, &start, e, notes);
    if (!asks_sight) continue;
    RelaxSight(o, growth, first, target, *problem, &start, e, notes);
  }
  problem->target_body.reset();
  if (request.target_body) SetTargetBody(*request.target_body, hard, &start, problem, notes);
}

Problem MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes) {
  Problem problem;
  MakeProblem(config, request, notes, &problem);
  return problem;
}

void WithRoom(const Problem& problem, double room, Enlargements* memory, Problem* roomy) {
  roomy->t0 = problem.t0;
  roomy->duration = problem.duration;
  roomy->sigmas = problem.sigmas;
  roomy->sight_radius = problem.sight_radius;
  roomy->target_growth = problem.target_growth;
  roomy->target_body = problem.target_body;
  roomy->degree = problem.degree;
  roomy->start = problem.start;
  roomy->target = problem.target;
  roomy->limits = problem.limits;
  roomy->reach = problem.reach;
  roomy->near.clear();
  const size_t n = problem.reach ? problem.near.size() : problem.obstacles.size();
  roomy->obstacles.resize(n);
  const Hull target(problem.target);
  const FirstSight first(problem);
  for (size_t i = 0; i < n; ++i) {
    const size_t j = problem.reach ? static_cast<size_t>(problem.near[i]) : i;
    roomy->near.push_back(static_cast<int>(i));
    Ellipsoid& e = roomy->obstacles[i];
    e = problem.obstacles[j];
    if (!(room > 0.0)) continue;
    const Enlarged& safety = memory->Of(2 * j, e.safety, room);
    const Eigen::Vector3d offset = (problem.start.row(0) - e.center.row(0)).transpose();
    if (SquaredNorm(safety.shape, offset) > kClear) {
      e.safety = safety.shape;
      e.safety_half = e.safety_half.max(safety.half);
    }
    const Enlarged& sight = memory->Of(2 * j + 1, e.sight, room);
    if (first.IsBeyond(e.center, sight.shape, sight.half, kClear) &&
        (IsPlainlyOutside(target, e.center, sight.half) ||
         StaysOutside(problem.target, e.center, sight.shape, kClear))) {
      e.sight = sight.shape;
      e.sight_half = e.sight_half.max(sight.half);
    }
  }
}

Curve ToCurve(const world::Trajectory& trajectory, double start, double duration) {
  Curve curve;
  world::SetCurve(trajectory, start, duration, &curve);
  return curve;
}

Eigen::Vector3d Evaluate(const Curve& curve, double tau, int order) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index k = curve.rows() - 1; k >= order; --k) {
    double falling = 1.0;
    for (int i = 0; i < order; ++i) falling *= static_cast<double>(k - i);
    sum = sum * tau + falling * curve.row(k).transpose();
  }
  return sum;
}

}  // namespace chase::planning
