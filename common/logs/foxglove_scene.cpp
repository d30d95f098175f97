#include "common/logs/foxglove_scene.h"

#include <Eigen/Eigenvalues>
#include <iterator>
#include <vector>

#include "common/bus/convert.h"
#include "common/world/forecast.h"

namespace chase::logs {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kCurvePoints = 25;                              // 0.1 s of a horizon of 2.5 s
constexpr int kSpreads = 5;                                   // ellipsoids along a forecast
constexpr double kThickness = 0.04;                           // of a curve, m
constexpr double kTargetSigmas = 3.0, kForecastSigmas = 2.0;  // as on chase-viewer's page
constexpr int kLineStrip = 0, kLineList = 2;                  // LinePrimitive's types

struct Tint {
  double r, g, b, a;
};
constexpr Tint kStill = {0.55, 0.57, 0.6, 0.5}, kMoving = {0.8, 0.2, 0.2, 0.6},
               kGround = {0.5, 0.45, 0.35, 0.3}, kTarget = {0.91, 0.44, 0.04, 0.9},
               kVelocity = {1.0, 0.54, 0.5, 1.0}, kSpread = {1.0, 0.82, 0.3, 0.15},
               kForecast = {1.0, 0.82, 0.3, 1.0}, kFence = {0.88, 0.36, 0.82, 1.0},
               kGrown = {0.79, 0.54, 0.54, 0.15};
/// By plan_t's verdicts, as on chase-viewer's page.
constexpr Tint kVerdicts[] = {{0.25, 0.65, 0.42, 1.0}, {0.44, 0.75, 0.45, 1.0},
                              {0.3, 0.61, 0.91, 1.0},  {0.85, 0.64, 0.23, 1.0},
                              {0.85, 0.33, 0.31, 1.0}, {0.49, 0.53, 0.59, 1.0},
                              {0.71, 0.33, 0.79, 1.0}, {0.6, 0.1, 0.1, 1.0}};
constexpr Tint kUnknown = {1.0, 1.0, 1.0, 1.0};

// SceneEntity's numbers of the primitives.
enum Primitive { kArrow = 7, kCube = 8, kSphere = 9, kCylinder = 10, kLine = 11 };

Proto Color(const Tint& t) {
  return Proto().Double(1, t.r).Double(2, t.g).Double(3, t.b).Double(4, t.a);
}

/// The entity that all earlier ones of this name give way to.
Proto Entity(int64_t utime, const char* name) {
  return Proto().Put(1, Stamp(utime)).Bytes(2, "world").Bytes(3, name).Put(4, Proto());
}

std::string Scene(const Proto& entity) { return Proto().Put(2, entity).bytes(); }

Proto Solid(Primitive kind, const Proto& pose, const Vector3d& size, const Tint& tint) {
  Proto solid;
  solid.Put(1, pose).Put(2, Vector(size));
  if (kind == kCylinder) solid.Double(3, 1.0).Double(4, 1.0);
  return solid.Put(kind == kCylinder ? 5 : 3, Color(tint));
}

/// Half its axes are the eigenvalues of M, symmetric, to this power: 0.5 for a covariance, -0.5 for
/// { x : x' M x <= 1 }; then they are `longer`, m.
Proto Ellipsoid(const Vector3d& center, const Matrix3d& M, double power, const Tint& tint,
                double longer = 0.0) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(M);
  Matrix3d R = axes.eigenvectors();
  if (R.determinant() < 0.0) R.col(0) *= -1.0;
  const Vector3d size = 2.0 * (axes.eigenvalues().array().max(1e-9).pow(power) + longer);
  return Solid(kSphere, Pose(center, Quaterniond(R)), size, tint);
}

/// From `center`, as long as `velocity` leads in a second.
Proto Arrow(const Vector3d& center, const Vector3d& velocity) {
  const double length = velocity.norm();
  const Quaterniond along = Quaterniond::FromTwoVectors(Vector3d::UnitX(), velocity);
  return Proto()
      .Put(1, Pose(center, along))
      .Double(2, 0.8 * length)
      .Double(3, kThickness)
      .Double(4, 0.2 * length)
      .Double(5, 3.0 * kThickness)
      .Put(6, Color(kVelocity));
}

Proto Line(int type, double thickness, const std::vector<Vector3d>& points, const Tint& tint) {
  Proto line;
  line.Int(1, type).Put(2, Pose(Vector3d::Zero(), Quaterniond::Identity())).Double(3, thickness);
  for (const Vector3d& p : points) line.Put(5, Vector(p));
  return line.Put(6, Color(tint));
}

Proto Curve(const polynomial_t& m, double thickness, const Tint& tint) {
  const world::Trajectory path = bus::FromMessage(m, m.utime);
  std::vector<Vector3d> points;
  for (int i = 0; i <= kCurvePoints; ++i)
    points.push_back(path.Position(path.start + path.duration * i / kCurvePoints));
  return Line(kLineStrip, thickness, points, tint);
}

/// Its solid with half its sizes larger by `radius`, m.
void AddSolid(const obstacle_t& o, const world::Obstacle& obstacle, double radius, const Tint& tint,
              Proto* entity) {
  const Vector3d center = obstacle.center.Position(0.0);
  const Vector3d size = 2.0 * (bus::ToVector(o.half).array() + radius);
  if (o.solid == obstacle_t::BOX)
    entity->Put(kCube, Solid(kCube, Pose(center, ToRotation(o.orientation)), size, tint));
  else if (o.solid == obstacle_t::CYLINDER)
    entity->Put(kCylinder, Solid(kCylinder, Pose(center, Quaterniond::Identity()), size, tint));
  else
    entity->Put(kSphere, Ellipsoid(center, obstacle.shape, -0.5, tint, radius));
}

void Add(const obstacle_t& o, int64_t utime, Proto* entity) {
  const Tint& tint = o.kind == obstacle_t::MOVING   ? kMoving
                     : o.kind == obstacle_t::GROUND ? kGround
                                                    : kStill;
  const world::Obstacle obstacle = bus::FromMessage(o, utime);
  AddSolid(o, obstacle, 0.0, tint, entity);
  const Vector3d center = obstacle.center.Position(0.0), v = obstacle.center.Velocity(0.0);
  if (o.kind == obstacle_t::MOVING && v.norm() > 0.0) entity->Put(kArrow, Arrow(center, v));
}

}  // namespace

Proto Stamp(int64_t utime) {
  return Proto().Int(1, utime / 1000000).Int(2, utime % 1000000 * 1000);
}
Proto Vector(const Vector3d& v) {
  return Proto().Double(1, v.x()).Double(2, v.y()).Double(3, v.z());
}
Proto Rotation(const Quaterniond& q) {
  return Proto().Double(1, q.x()).Double(2, q.y()).Double(3, q.z()).Double(4, q.w());
}
Proto Pose(const Vector3d& p, const Quaterniond& q) {
  return Proto().Put(1, Vector(p)).Put(2, Rotation(q));
}

std::string SceneOf(const obstacles_t& m) {
  Proto entity = Entity(m.utime, "obstacles");
  for (const obstacle_t& o : m.obstacles) Add(o, m.utime, &entity);
  return Scene(entity);
}

std::string GrownSceneOf(const obstacles_t& m, double radius) {
  Proto entity = Entity(m.utime, "grown");
  if (radius <= 0.0) return Scene(entity);
  for (const obstacle_t& o : m.obstacles)
    if (o.kind != obstacle_t::GROUND)
      AddSolid(o, bus::FromMessage(o, m.utime), radius, kGrown, &entity);
  return Scene(entity);
}

std::string SceneOf(const target_t& m) {
  Proto entity = Entity(m.utime, "target");
  if (m.state != target_t::TRACKING && m.state != target_t::OCCLUDED) return Scene(entity);
  const Vector3d mean = bus::ToVector(m.mean);
  entity.Put(kCylinder, Solid(kCylinder, Pose(mean, Quaterniond::Identity()),
                              {2 * m.radius, 2 * m.radius, m.height}, kTarget));
  const Matrix3d S = kTargetSigmas * kTargetSigmas * bus::ToMatrix(m.covariance);
  entity.Put(kSphere, Ellipsoid(mean, S, 0.5, kSpread));
  return Scene(entity);
}

std::string SceneOf(const plan_t& m) {
  const auto verdict = static_cast<uint8_t>(m.verdict);
  Tint tint = verdict < std::size(kVerdicts) ? kVerdicts[verdict] : kUnknown;
  Proto entity = Entity(m.utime, "plan");
  if (m.position.n_coefficients > 0) entity.Put(kLine, Curve(m.position, kThickness, tint));
  tint.a = 0.35;
  if (m.stop.n_coefficients > 0) entity.Put(kLine, Curve(m.stop, 2.0 * kThickness, tint));
  return Scene(entity);
}

std::string SceneOf(const prediction_t& m) {
  Proto entity = Entity(m.utime, "prediction");
  if (m.target.n_coefficients == 0) return Scene(entity);
  entity.Put(kLine, Curve(m.target, kThickness, kForecast));
  const world::Trajectory path = bus::FromMessage(m.target, m.target.utime);
  for (int i = 1; i <= kSpreads; ++i) {
    const double t = path.duration * i / kSpreads;
    const Matrix3d S = world::ForecastCovariance(bus::ToMatrix(m.covariance),
                                                 bus::ToMatrix(m.velocity_covariance), t);
    entity.Put(kSphere, Ellipsoid(path.Position(path.start + t),
                                  kForecastSigmas * kForecastSigmas * S, 0.5, kSpread));
  }
  return Scene(entity);
}

std::string SceneOf(const geofence_t& m) {
  std::vector<Vector3d> ends;
  const size_t n = m.corners.size() / 2;
  for (size_t i = 0; i < n; ++i) {
    const size_t k = (i + 1) % n;
    const auto at = [&](size_t corner, double z) {
      return Vector3d(m.corners[2 * corner], m.corners[2 * corner + 1], z);
    };
    for (const double z : {m.floor, m.ceiling}) ends.insert(ends.end(), {at(i, z), at(k, z)});
    ends.insert(ends.end(), {at(i, m.floor), at(i, m.ceiling)});
  }
  Proto entity = Entity(m.utime, "geofence");
  if (!ends.empty()) entity.Put(kLine, Line(kLineList, kThickness, ends, kFence));
  return Scene(entity);
}

}  // namespace chase::logs
