#include "services/planning/problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/world/forecast.h"
#include "services/planning/candidate_set.h"
#include "services/planning/field_of_view.h"
#include "services/planning/margins.h"
#include "services/planning/separations.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

constexpr double kRounding = 1e-6;    // m, and of a limit: by which one gives way at least
constexpr double kBackInView = 0.25;  // tau by which a plan sees a target that it starts without

// Deviations of the obstacle's position along the worst axis, times sigmas.
struct Uncertainty {
  double now = 0.0, then = 0.0;  // at tau = 0 and 1

  explicit Uncertainty(const world::Body& body) {
    if (body.sigmas == 0.0) return;
    const Eigen::Array3d at_0 = body.covariance[0].diagonal().array();
    const Eigen::Array3d at_1 =
        at_0 + body.covariance[1].diagonal().array() + body.covariance[2].diagonal().array();
    now = body.sigmas * std::sqrt(std::max(0.0, at_0.maxCoeff()));
    then = body.sigmas * std::sqrt(std::max(0.0, at_1.maxCoeff()));
  }
  double most() const { return std::max(now, then); }
};

// Boxes around the Minkowski sums: half the sides of the solid's, and what it is grown by at most.
void SetBoxes(const world::Obstacle& o, const Growth& most, Ellipsoid* e) {
  Eigen::Array3d half = o.half.array();
  if (o.solid == world::Obstacle::Solid::kBox)
    half = (o.axes.toRotationMatrix().cwiseAbs() * o.half).array();
  else if (o.solid == world::Obstacle::Solid::kEllipsoid)
    half =
        e->body ? Eigen::Array3d(e->body->shape.diagonal().array().sqrt()) : HalfSidesOf(o.shape);
  e->safety_half = half + most.safety;
  e->sight_half = half + most.sight;
}

// Returns what is not known of its place. What depends on the shape alone is kept, here and in
// SetShapes, where the obstacle is what it was.
Uncertainty SetBody(const PlannerConfig& config, const Stretch& over, double flown,
                    const world::Obstacle& o, bool same_shape, Ellipsoid* e) {
  const auto retimed = [&](world::Body* body) {
    world::Retime(o, over.t0, over.horizon, config.sigmas, flown, body);
    return Uncertainty(*body);
  };
  if (config.minkowski_sums) {
    if (same_shape && e->body && e->body->kind == o.solid &&
        o.solid == world::Body::Kind::kEllipsoid)
      return retimed(&*e->body);
    e->body = world::MakeBody(o, over.t0, over.horizon, config.sigmas, flown);
    return Uncertainty(*e->body);
  }
  e->body.reset();
  world::Body body;
  return retimed(&body);
}
void SetShapes(const Stretch& over, const world::Obstacle& o, const Growth& growth, bool same_shape,
               Ellipsoid* e) {
  e->grown_from = o.shape;
  // Heights sort out candidates on the ground, as no ellipsoid fits a slab; without a search there
  // are none.
  if (o.ground || (!over.asks_sight && e->body)) {
    e->safety = e->sight = kPoint * Eigen::Matrix3d::Identity();
    e->grown_by[0] = -1.0;
    return;
  }
  if (same_shape && e->grown_by[0] == growth.safety && e->grown_by[1] == growth.sight) return;
  const Eigen::Matrix3d shape = SortingShape(o, *e);
  e->safety = e->sight = shape;
  if (growth.safety > 0.0 || growth.sight > 0.0) {
    const world::Inflation inflation(shape);
    if (growth.safety > 0.0) e->safety = inflation.By(growth.safety);
    if (growth.sight > 0.0) e->sight = inflation.By(growth.sight);
  }
  e->grown_by[0] = growth.safety;
  e->grown_by[1] = growth.sight;
}

// How far a motion with speed v and acceleration a goes on that slows down after a moment, at half
// of the greatest acceleration.
double Overshoot(double v, double a, double most) {
  constexpr double kMoment = 0.2;  // s
  const double then = v + kMoment * std::max(0.0, a);
  return then > 0.0 ? std::max(0.0, v) * kMoment + then * then / most : 0.0;
}

// The limit of x, widened for a start that cannot keep it: not for one that braking at once at the
// greatest acceleration brings to rest within it.
double GivingWay(double limit, double x, double v, double a, double most) {
  const double least = x + std::max(0.0, v) * v / (2.0 * most) + kRounding;
  if (least <= limit + 2.0 * kRounding) return std::max(limit, least);
  return std::max(limit, x + Overshoot(v, a, most) + kRounding);
}

// Limits that the start already breaks give way to what it has: no chain of plans gets worse.
// Heights give way to what the start cannot help only, so that none sinks. What is below the drone
// its LiDAR sees on the way there only: it comes down along that slope, or slowly, until it is
// level with people. A tube that is `wider` than the file's, m, reaches no higher than that.
Limits MakeLimits(const PlannerConfig& c, const Stretch& over, const Eigen::Vector3d& target,
                  const Ground& ground, double wider) {
  constexpr double kOverhead = 10.0;    // tangent from which there is no side to be on
  constexpr double kUnseenDrop = 0.15;  // m: replanned, half a metre a second
  constexpr double kPerson = 1.7;       // m high
  const auto at_least = [](double limit, double now) {
    return limit > 0.0 ? std::max(limit, (1.0 + kRounding) * now + kRounding) : 0.0;
  };
  const world::State& s = over.start;
  Limits limits;
  limits.speed = at_least(c.max_speed, s.v.norm());
  limits.acceleration = at_least(c.max_acceleration, s.a.norm());
  limits.height = c.z_max > c.z_min;
  const double push = c.max_acceleration > 0.0 ? limits.acceleration : kPush;
  const double v = ground.Rise(s.v), a = ground.Rise(s.a), z = ground.Above(s.p);
  limits.ground = ground;
  const double seen_to = z - kUnseenDrop - kSightSlope * s.v.head<2>().norm() * over.horizon;
  limits.z_min = -GivingWay(-c.z_min, -z, -v, -a, push);
  limits.z_max = GivingWay(c.z_max - wider, z, v, a, push);
  if (seen_to > std::max(kPerson, limits.z_min))
    limits.z_min = std::min(seen_to, z - Overshoot(-v, -a, push) - kRounding);
  const Eigen::Vector3d r = target - s.p;
  const double tangent = std::tan(c.max_elevation_deg * M_PI / 180.0);
  const double now = std::abs(r.z()) / std::max(r.head<2>().norm(), 1e-3);
  limits.tan_elevation = now < kOverhead ? at_least(tangent, now) : 0.0;
  limits.min_distance =
      std::min(c.min_distance, std::max(0.0, (1.0 - kRounding) * r.norm() - kRounding));
  if (!over.asks_sight) return limits;
  limits.view = c.view();
  const double below = SeenBelow(r, s.v, s.a, c.drag);
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

// Until `ahead` s after its forecast was made the target's manoeuvres add at most this times the
// square of the time to the variance of its place, as what they add grows over that square,
// m^2/s^2.
double ManoeuvreRate(const world::Manoeuvre& manoeuvre, double ahead) {
  return ahead > 0.0 ? manoeuvre.Variance(ahead) / (ahead * ahead) : 0.0;
}

// Of a motion along the ground, where that of its level part is 1 along each axis.
Eigen::Matrix3d AlongGround(const Ground& ground) {
  Eigen::Matrix<double, 3, 2> along;
  along << 1.0, 0.0, 0.0, 1.0, ground.slope_x, ground.slope_y;
  return along * along.transpose();
}

// The target's own body, to which no margin is kept. Its manoeuvres, which lead along the ground,
// count for `flown` s; they add to its velocity's variance, so that they go on to count after that,
// but for less than they may.
void SetTargetBody(const PlanRequest& request, double flown, double hard, StartCheck* start,
                   Problem* problem, std::string* notes) {
  world::Obstacle o = *request.target_body;
  o.moving = false;  // no listed mover: its manoeuvres are added here
  const double ahead = problem->t0 + std::min(flown, problem->duration) - o.center.start;
  o.velocity_covariance +=
      ManoeuvreRate(request.target_manoeuvre, ahead) * AlongGround(problem->limits.ground);
  Ellipsoid e;
  e.id = kTargetId;
  e.body = world::MakeBody(o, problem->t0, problem->duration, problem->sigmas);
  e.center = ToCurve(o.center, problem->t0, problem->duration);
  e.grown_from = o.shape;
  e.sight_from = kNoSight;
  e.safety_radius = hard;
  SetBoxes(o, {hard + Uncertainty(*e.body).most(), 0.0}, &e);
  if (!start->IsSafe(e, hard)) {
    e.safety_from = kLeaveBy;
    Note(notes, "starts at the target");
  }
  problem->target_body = e;
}

// A chord over the deviation, which is convex in tau and grows with the forecast's age.
math::Polynomial TargetGrowth(const PlannerConfig& config, const PlanRequest& request,
                              const Stretch& over) {
  const double age = over.t0 - request.target.start;
  const auto deviations = [&](double since) {
    const double steadily = std::hypot(request.target_sigma, request.target_speed_sigma * since);
    return config.sigmas *
           std::hypot(steadily, std::sqrt(request.target_manoeuvre.Variance(since)));
  };
  math::Polynomial growth(2);
  growth << deviations(age), deviations(age + over.horizon) - deviations(age);
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

void MakeProblem(const PlannerConfig& config, const PlanRequest& request, const Stretch& over,
                 std::string* notes, Problem* problem,
                 const std::vector<world::Obstacle>& besides) {
  problem->t0 = over.t0;
  problem->duration = over.horizon;
  problem->degree = config.degree;
  problem->start = StartCurve(over.start, over.horizon);
  problem->target = ToCurve(request.target, over.t0, over.horizon);
  problem->limits =
      MakeLimits(config, over, problem->target.row(0).transpose(), GroundOf(request.obstacles),
                 HardRadius(config, request) - config.hard_radius());
  problem->limits.listed_about = request.start.p.head<2>();
  problem->limits.listed_within = request.listed_within;
  problem->skeletons.clear();
  problem->reach.reset();
  const size_t listed = request.obstacles.size();
  problem->obstacles.resize(listed + besides.size());
  problem->sigmas = config.sigmas;
  problem->sight_radius = config.sight_margin;
  problem->target_growth.setZero(2);
  if (over.asks_sight) problem->target_growth = TargetGrowth(config, request, over);
  const double sight = config.sight_margin + 0.5 * problem->target_growth.sum();
  const double hard = HardRadius(config, request);
  // The margin holds what a wider tube takes of it.
  const double margin = std::max(0.0, config.safety_margin - (hard - config.hard_radius()));
  // A plan that chases is flown until its stop begins, or until a newer one takes its place; ways
  // to rest are flown to their ends.
  const double flown = over.asks_sight ? kOverdue : over.horizon;
  const FirstSight first(*problem);
  StartCheck start(*problem);
  const Box at_start{first.p.array(), first.p.array()};
  std::optional<Hull> target;
  Box own = first.box;
  if (over.asks_sight) {
    target.emplace(problem->target);
    own = {own.low.min(target->whole.low), own.high.max(target->whole.high)};
  }
  for (size_t j = 0; j < problem->obstacles.size(); ++j) {
    const world::Obstacle& o = j < listed ? request.obstacles[j] : besides[j - listed];
    Ellipsoid* e = &problem->obstacles[j];
    e->id = o.id;
    e->index = static_cast<int>(j);
    e->safety_from = 0.0;
    const bool asks_sight = over.asks_sight && !o.ground;
    e->ground = o.ground;
    e->sight_from = asks_sight ? 0.0 : kNoSight;
    e->sight_share = 1.0;
    e->safety_radius = hard + margin;
    const bool same_shape = IsSameShape(e->grown_from, o.shape);
    const Uncertainty uncertain = SetBody(config, over, flown, o, same_shape, e);
    const double mean = 0.5 * (uncertain.now + uncertain.then), most = uncertain.most();
    const Growth growth{hard + margin + mean, sight + mean};
    SetShapes(over, o, growth, same_shape, e);
    if (e->body)
      e->center = e->body->center;
    else
      world::SetCurve(o.center, over.t0, over.horizon, &e->center);
    const Growth widest{hard + margin + most,
                        config.sight_margin + problem->target_growth.sum() + most};
    SetBoxes(o, widest, e);
    const bool searched = !o.ground && (over.asks_sight || !e->body);
    if (e->body && searched) ClearStart(o, growth.safety, problem->start, e);
    // Far from start and target no margin has to give way.
    if (MayTouch(at_start, e->center, e->safety_half, kClear))
      RelaxSafety(o, hard, margin, uncertain.now, searched, &start, e, notes);
    if (asks_sight && MayTouch(own, e->center, e->sight_half, kClear))
      RelaxSight(o, growth, first, *target, *problem, &start, e, notes);
  }
  problem->target_body.reset();
  if (request.target_body) SetTargetBody(request, flown, hard, &start, problem, notes);
}

Problem MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes) {
  Problem problem;
  MakeProblem(config, request, request, notes, &problem);
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
