#pragma once

#include "services/planning/problem.h"
#include "test/unit/planning_instances.h"
#include "test/unit/separation_model.h"

// Chases among random solids, and distances by nearest points: what a plan claims has to hold in
// the Minkowski sum itself.

namespace chase::planning::minkowski {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using world::Random;

inline constexpr int kInstants = 50;
inline constexpr double kTolerance = 1e-6;  // m

/// Walls, pillars, lumps; every other one moves with an uncertainty that grows.
inline world::Obstacle RandomObstacle(Random* random, const PlanRequest& request, int id) {
  world::Obstacle o;
  o.id = id;
  o.moving = random->Uniform() < 0.4;
  o.solid = static_cast<world::Obstacle::Solid>(random->Next() % 3);
  o.half = world::RandomHalfSizes(random);
  if (o.solid == world::Obstacle::Solid::kCylinder) o.half.y() = o.half.x();
  o.axes = Eigen::Quaterniond(world::RandomRotation(random, random->Uniform() < 0.7));
  const bool turned = o.solid != world::Obstacle::Solid::kCylinder;
  const Matrix3d R = turned ? o.axes.toRotationMatrix() : Matrix3d(Matrix3d::Identity());
  o.shape = R * o.half.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
  o.shape = (0.5 * (o.shape + o.shape.transpose())).eval();
  const Vector3d middle = request.target.Position(random->Uniform(0.0, request.horizon));
  o.center.start = request.t0 - random->Uniform(0.0, 0.2);
  o.center.duration = request.horizon;
  o.center.coefficients = Eigen::MatrixXd::Zero(o.moving ? 2 : 1, 3);
  o.center.coefficients.row(0) = (middle + world::RandomVector(random, 4.0, 4.0, 0.5)).transpose();
  if (!o.moving) return o;
  o.center.coefficients.row(1) =
      request.horizon * world::RandomVector(random, 0.8, 0.8, 0.1).transpose();
  for (Matrix3d* S : {&o.position_covariance, &o.velocity_covariance}) {
    const Matrix3d axes = world::RandomRotation(random, true);
    const Vector3d deviation(random->Uniform(0.01, 0.1), random->Uniform(0.01, 0.1), 0.02);
    *S = axes * deviation.cwiseAbs2().asDiagonal() * axes.transpose();
    *S = (0.5 * (*S + S->transpose())).eval();
  }
  return o;
}

inline PlanRequest RandomRequest(const PlannerConfig& config, unsigned seed) {
  InstanceSpec spec;
  spec.horizon = 2.5;
  spec.n_obstacles = 0;
  PlanRequest request = InstanceGenerator(config, spec).Make(seed);
  const double age = Random(seed, 78).Uniform(0.0, 0.5);  // of the forecast, s
  request.target = request.target.Reparametrised(request.t0 - age, request.horizon + age);
  Random random(seed, 77);
  request.target_sigma = random.Uniform(0.0, 0.05);
  request.target_speed_sigma = random.Uniform(0.0, 0.1);
  request.target_manoeuvre = {random.Uniform(0.0, 0.5), random.Uniform(0.2, 2.0)};
  const int n = 2 + static_cast<int>(random.Next() % 9);
  for (int i = 0; i < n; ++i) request.obstacles.push_back(RandomObstacle(&random, request, i));
  return request;
}

/// What surrounds a flight besides what is listed: a wider tube, the target's body, places that
/// nobody has looked into.
inline void Surround(unsigned seed, PlanRequest* request) {
  Random random(seed, 79);
  if (random.Uniform() < 0.5) request->tube = random.Uniform(0.12, 0.3);
  if (random.Uniform() < 0.7) {
    world::Obstacle& body = request->target_body.emplace();
    body.id = kTargetId;
    body.moving = true;
    body.solid = world::Obstacle::Solid::kCylinder;
    const double radius = random.Uniform(0.15, 0.4), height = random.Uniform(0.5, 1.8);
    body.half = {radius, radius, 0.5 * height};
    body.shape = body.half.cwiseAbs2().cwiseInverse().asDiagonal();
    body.center = request->target;
    const auto level = [&random](double most) {
      const double deviation = random.Uniform(0.0, most);
      return Matrix3d(deviation * deviation * Vector3d(1.0, 1.0, 0.0).asDiagonal());
    };
    body.position_covariance = level(0.05);
    body.velocity_covariance = level(0.1);
  }
  for (int k = static_cast<int>(random.Next() % 4); k > 0; --k) {
    world::Obstacle o = RandomObstacle(&random, *request, 1000 + k);
    o.moving = false;
    o.center.coefficients.conservativeResize(1, 3);
    o.position_covariance.setZero();
    o.velocity_covariance.setZero();
    request->unseen.push_back(o);
  }
}

/// The obstacle over [start, start + duration], written anew; of it `flown` s are flown.
inline world::Body Truth(const world::Obstacle& o, double start, double duration, double sigmas,
                         double flown = HUGE_VAL) {
  world::Body body;
  body.kind = o.solid;
  body.half = o.half;
  body.shape = o.solid == world::Obstacle::Solid::kBox ? o.axes.toRotationMatrix()
                                                       : Matrix3d(o.shape.inverse());
  const Vector3d v = o.center.Velocity(start);
  body.center = Curve::Zero(2, 3);
  body.center.row(0) = o.center.Position(start).transpose();
  body.center.row(1) = duration * v.transpose();
  const double age = start - o.center.start;
  body.sigmas = o.moving ? sigmas : 0.0;
  Matrix3d V = o.velocity_covariance;
  const double unlisted = age + std::min(flown, duration) - 0.5;
  for (int a = 0; a < 2; ++a)
    if (o.moving && unlisted > 0.0) V(a, a) += 0.4 * unlisted / 3.0;
  body.covariance[0] = o.position_covariance + age * age * V;
  body.covariance[1] = 2.0 * age * duration * V;
  body.covariance[2] = duration * duration * V;
  return body;
}

/// Gap of the drone's ball from the body at tau, or of its hull with the target's.
inline double Gap(const world::Ball& drone, const world::Ball* target, const world::Body& body,
                  double tau) {
  return world::GapAt({drone, target ? *target : drone, target != nullptr, body}, tau);
}

/// The least over [from, 1].
inline double LeastGap(const world::Ball& drone, const world::Ball* target, const world::Body& body,
                       double from) {
  double least = HUGE_VAL;
  for (int i = 0; i <= kInstants; ++i)
    least = std::min(least, Gap(drone, target, body, from + (1.0 - from) * i / kInstants));
  return least;
}
inline double LeastGap(const world::Trajectory& way, double radius, double from,
                       const world::Ball* target, const world::Obstacle& o, double sigmas,
                       double flown = HUGE_VAL) {
  return LeastGap({way.coefficients, math::Polynomial::Constant(1, radius)}, target,
                  Truth(o, way.start, way.duration, sigmas, flown), from);
}

/// Least gap of a ball of `radius` on its way from the target's body, until `until`, s, with all
/// that its forecast does not know, instant by instant.
inline double LeastGapFromTarget(const PlanRequest& request, const world::Trajectory& way,
                                 double radius, double until, double sigmas) {
  const world::Obstacle& o = *request.target_body;
  double least = HUGE_VAL;
  for (int i = 0; i <= kInstants; ++i) {
    const double t = way.start + (until - way.start) * i / kInstants;
    const double age = t - o.center.start;
    world::Body body;
    body.kind = o.solid;
    body.half = o.half;
    body.center = o.center.Position(t).transpose();
    body.sigmas = sigmas;
    body.covariance[0] = o.position_covariance + age * age * o.velocity_covariance;
    for (int a = 0; a < 2; ++a) body.covariance[0](a, a) += request.target_manoeuvre.Variance(age);
    const world::Ball drone{Curve(way.Position(t).transpose()),
                            math::Polynomial::Constant(1, radius)};
    least = std::min(least, Gap(drone, nullptr, body, 0.0));
  }
  return least;
}

/// The target's ball with a share of its margins of sight.
inline world::Ball SeenBall(const Problem& problem, double share) {
  math::Polynomial radius = share * problem.target_growth;
  radius[0] += share * problem.sight_radius;
  return {problem.target, radius};
}

/// Standard deviation of the target's place along an axis at t, m.
inline double TargetSigma(const PlanRequest& request, double t) {
  const double since = t - request.target.start;
  const double v = request.target_speed_sigma * since;
  return std::sqrt(request.target_sigma * request.target_sigma + v * v +
                   request.target_manoeuvre.Variance(since));
}

}  // namespace chase::planning::minkowski
