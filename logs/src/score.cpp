#include <algorithm>

#include "logs/src/metrics.h"

namespace chase::logs {
namespace {

using Eigen::Vector3d;
using world::Solid;

/// A solid with the radius of a sphere that encloses it, so that distant ones cost nothing.
struct Bounded {
  Solid solid;
  double radius;
  explicit Bounded(const Solid& s) : solid(s), radius(s.half_size.norm()) {}
};

std::vector<Solid> MoversAt(const world::Scenario& scenario, double t) {
  std::vector<Solid> solids;
  for (const auto& mover : scenario.movers) solids.push_back(world::MoverAt(mover, t).solid);
  return solids;
}

Solid TargetBody(const world::TargetSpec& target, const Vector3d& center) {
  return {Solid::Kind::kCylinder, center,
          Vector3d(target.radius, target.radius, 0.5 * target.height), 0.0};
}

double NearestSurface(const std::vector<Bounded>& solids, const Vector3d& p, double nearest) {
  for (const Bounded& b : solids)
    if ((p - b.solid.center).norm() - b.radius < nearest)
      nearest = std::min(nearest, world::SignedDistance(b.solid, p));
  return nearest;
}

double NearestSurface(const std::vector<Solid>& solids, const Vector3d& p, double nearest) {
  for (const Solid& s : solids) nearest = std::min(nearest, world::SignedDistance(s, p));
  return nearest;
}

bool Blocked(const std::vector<Bounded>& solids, const Vector3d& p, const Vector3d& q) {
  const Vector3d middle = 0.5 * (p + q);
  const double half = 0.5 * (p - q).norm();
  return std::any_of(solids.begin(), solids.end(), [&](const Bounded& b) {
    return (middle - b.solid.center).norm() <= half + b.radius && world::SegmentHits(b.solid, p, q);
  });
}

bool Blocked(const std::vector<Solid>& solids, const Vector3d& p, const Vector3d& q) {
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& s) { return world::SegmentHits(s, p, q); });
}

class Scorer {
 public:
  explicit Scorer(const world::Scenario& scenario) : scenario_(scenario) {
    for (const Solid& s : world::StaticSolids(scenario)) solids_.emplace_back(s);
  }

  SampleScore operator()(const TruthSample& s) const {
    const auto movers = MoversAt(scenario_, s.t);
    SampleScore score;
    score.t = s.t;
    score.distance = (s.p - s.target).norm();
    score.clearance = Clearance(s, movers);
    score.visible = !Blocked(solids_, s.p, s.target) && !Blocked(movers, s.p, s.target);
    return score;
  }

 private:
  double Clearance(const TruthSample& s, const std::vector<Solid>& movers) const {
    double d = s.p.z() - world::GroundHeight(scenario_.world.ground, s.p.x(), s.p.y());
    d = std::min(d, world::SignedDistance(TargetBody(scenario_.target, s.target), s.p));
    return NearestSurface(solids_, s.p, NearestSurface(movers, s.p, d)) - scenario_.chaser.radius;
  }

  const world::Scenario& scenario_;
  std::vector<Bounded> solids_;
};

}  // namespace

std::vector<SampleScore> Score(const FlightRecord& record) {
  const Scorer score(record.scenario);
  std::vector<SampleScore> scores;
  for (const TruthSample& s : record.truth)
    if (record.InMission(s.t)) scores.push_back(score(s));
  return scores;
}

}  // namespace chase::logs
