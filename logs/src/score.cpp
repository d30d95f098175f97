#include "logs/src/score.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "logs/src/metrics.h"

namespace chase::logs {
namespace {

using Eigen::Vector3d;
using world::Solid;

std::vector<Solid> MoversAt(const world::Scenario& scenario, double t) {
  std::vector<Solid> solids;
  for (const auto& mover : scenario.movers) solids.push_back(world::MoverAt(mover, t).solid);
  return solids;
}

std::string Name(const Solid& solid) {
  const char* kind = solid.kind == Solid::Kind::kBox        ? "box"
                     : solid.kind == Solid::Kind::kCylinder ? "cylinder"
                                                            : "ellipsoid";
  return fmt::format("{} at ({:.1f}, {:.1f})", kind, solid.center.x(), solid.center.y());
}

}  // namespace

Scorer::Scorer(const world::Scenario& scenario) : scenario_(scenario) {
  for (const Solid& s : world::StaticSolids(scenario)) solids_.emplace_back(s);
}

SampleScore Scorer::operator()(const TruthSample& s) const {
  const auto movers = MoversAt(scenario_, s.t);
  SampleScore score;
  score.t = s.t;
  score.distance = (s.p - s.target).norm();
  score.clearance = Clearance(s, movers);
  score.visible = Visible(s, movers);
  score.done = s.done;
  return score;
}

std::string Scorer::Nearest(const TruthSample& s) const {
  double nearest = ToGround(s);
  std::string name = "ground";
  const auto consider = [&](double distance, const std::string& what) {
    if (distance >= nearest) return;
    nearest = distance;
    name = what;
  };
  consider(ToTarget(s), "target");
  const auto movers = MoversAt(scenario_, s.t);
  for (size_t i = 0; i < movers.size(); ++i)
    consider(world::SignedDistance(movers[i], s.p), fmt::format("mover {}", i + 1));
  for (const Bounded& b : solids_) consider(world::SignedDistance(b.solid, s.p), Name(b.solid));
  return name;
}

double Scorer::ToGround(const TruthSample& s) const {
  const Vector3d& p = s.p;
  if (s.may_stand) return std::numeric_limits<double>::infinity();
  return p.z() - world::GroundHeight(scenario_.world.ground, p.x(), p.y());
}

double Scorer::ToTarget(const TruthSample& s) const {
  return world::SignedDistance(world::TargetSolid(scenario_.target, s.target, s.target_yaw), s.p);
}

double Scorer::Clearance(const TruthSample& s, const std::vector<Solid>& movers) const {
  double nearest = std::min(ToGround(s), ToTarget(s));
  for (const Solid& mover : movers) nearest = std::min(nearest, world::SignedDistance(mover, s.p));
  for (const Bounded& b : solids_)
    if ((s.p - b.solid.center).norm() - b.radius < nearest)
      nearest = std::min(nearest, world::SignedDistance(b.solid, s.p));
  return nearest - scenario_.chaser.radius;
}

bool Scorer::Visible(const TruthSample& s, const std::vector<Solid>& movers) const {
  const Vector3d middle = 0.5 * (s.p + s.target);
  const double half = 0.5 * (s.p - s.target).norm();
  const auto hit = [&](const Solid& solid) { return world::SegmentHits(solid, s.p, s.target); };
  return std::none_of(solids_.begin(), solids_.end(),
                      [&](const Bounded& b) {
                        return (middle - b.solid.center).norm() <= half + b.radius && hit(b.solid);
                      }) &&
         std::none_of(movers.begin(), movers.end(), hit);
}

std::vector<SampleScore> Score(const FlightRecord& record) {
  const Scorer score(record.scenario);
  std::vector<SampleScore> scores;
  for (const TruthSample& s : record.truth)
    if (record.InMission(s.t)) scores.push_back(score(s));
  return scores;
}

}  // namespace chase::logs
