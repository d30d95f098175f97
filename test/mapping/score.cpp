#include "score.h"

#include <fmt/format.h>

#include <cmath>

namespace chase::mapping_stage {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Obstacle;

constexpr int kEvery = 25;                  // sweeps between looks at the volume
constexpr double kCoverRadius = 8.0;        // m, of the drone: coverage
constexpr double kFreeRadius = 5.0;         // m, of the drone: free volume
constexpr double kLow = 0.35, kHigh = 2.9;  // m above the ground: the flight volume
constexpr double kSightRange = 12.0;        // m
constexpr double kMatchReach = 0.6;         // m, of a listed mover's centre from the true mover
constexpr int kSightHits = 8;               // returns in a sweep with which a mover is in sight
constexpr double kBeyond = 2.996;           // half of the 95 % quantile of chi-squared, 2 axes
constexpr double kNewSight = 2.0;           // s out of sight after which it comes into sight anew
constexpr double kWholeShare = 0.8;         // of a mover's usual returns: all of it is in sight

const Obstacle* Holder(const std::vector<Obstacle>& obstacles, const Vector3d& p, double t) {
  for (const auto& o : obstacles)
    if (!o.ground && o.SquaredDistance(p, t) <= 1.0) return &o;
  return nullptr;
}

}  // namespace

double Score::Ground(const Vector3d& p) const {
  return world::GroundHeight(course_.scenario.world.ground, p.x(), p.y());
}

/// Farther than `distance` m from every true solid.
bool Score::Free(const Vector3d& p, const Shot& shot, double distance) const {
  for (const int i : stage_.Near(p.x(), p.y()))
    if (world::SignedDistance(stage_.solids()[static_cast<size_t>(i)], p) <= distance) return false;
  for (const auto& mover : shot.movers)
    if (world::SignedDistance(mover.solid, p) <= distance) return false;
  return world::SignedDistance(shot.true_target.cylinder, p) > distance &&
         !(shot.true_target.has_carrier &&
           world::SignedDistance(shot.true_target.carrier, p) <= distance);
}

void Score::CheckVolume(const Shot& shot, const std::vector<Obstacle>& obstacles) {
  const double t = shot.sweep.t;
  long all = 0, held = 0;
  for (const auto& [cell, seen] : seen_) {
    if (seen.count < 3 || (seen.point - shot.place).head<2>().norm() > kCoverRadius) continue;
    ++all;
    held += Holder(obstacles, seen.point, t) != nullptr;
  }
  surface += all;
  surface_held += held;
  if (all)
    worst_coverage = std::min(worst_coverage, static_cast<double>(held) / static_cast<double>(all));
  int free = 0, blocked = 0;
  for (double dx = -kFreeRadius; dx <= kFreeRadius; dx += 0.15)
    for (double dy = -kFreeRadius; dy <= kFreeRadius; dy += 0.15)
      for (const double z : {0.5, 1.0, 1.5, 2.0, 2.5}) {
        if (dx * dx + dy * dy > kFreeRadius * kFreeRadius) continue;
        Vector3d p = shot.place + Vector3d(dx, dy, 0.0);
        if ((p.head<2>() - course_.low).minCoeff() < 0.0 ||
            (course_.high - p.head<2>()).minCoeff() < 0.0)
          continue;
        p.z() = Ground(p) + z;
        if (!Free(p, shot, 0.0)) continue;
        ++free;
        blocked += Holder(obstacles, p, t) != nullptr;
      }
  const double share = free ? static_cast<double>(blocked) / free : 0.0;
  blocked_sum += share;
  worst_blocked = std::max(worst_blocked, share);
  ++checks;
}

/// A place keeps its id while the obstacle of that id still holds it. Places: the axis of each
/// pillar or trunk, and of everything else the first point that was hit in squares of 1 m.
void Score::FollowIds(const Shot& shot, const std::vector<Obstacle>& obstacles) {
  std::map<Cell, Vector3d> places;
  for (const auto& hit : shot.hits) {
    const double height = hit.point.z() - Ground(hit.point);
    if (hit.solid < 0 || height < 0.8 || height > 2.0) continue;
    if ((hit.point - shot.place).head<2>().norm() > kCoverRadius) continue;
    const auto& solid = stage_.solids()[static_cast<size_t>(hit.solid)];
    if (solid.kind == world::Solid::Kind::kCylinder) {
      const Vector2d c = solid.center.head<2>();
      places[{hit.solid, 0, 0}] = {c.x(), c.y(), hit.point.z()};
    } else {
      const auto square = [](double x) { return static_cast<int>(std::floor(x + 0.37)); };
      const Cell key{hit.solid, square(hit.point.x()), square(hit.point.y())};
      places[key] = places_.insert({key, hit.point}).first->second;
    }
  }
  for (const auto& [key, p] : places) {
    const auto* any = Holder(obstacles, p, shot.sweep.t);
    if (!any) continue;
    obstacle_minutes += 0.1 / 60.0;
    const auto it = ids_.find(key);
    if (it == ids_.end()) {
      ids_[key] = any->id;
      continue;
    }
    const bool same = std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
      return o.id == it->second && o.SquaredDistance(p, shot.sweep.t) <= 1.0;
    });
    if (same) continue;
    if (trace_)
      fmt::print("{:7.2f} id {} -> {} at {:.2f} {:.2f}, solid {}\n", shot.sweep.t, it->second,
                 any->id, p.x(), p.y(), std::get<0>(key));
    ++id_changes;
    it->second = any->id;
  }
}

void Score::Judge(const Obstacle& o, const world::MoverState& truth, double t, int hits,
                  MoverScore* score) const {
  const double error = (o.center.Velocity(t) - truth.velocity).head<2>().norm();
  const double away = (o.center.Position(t) - truth.solid.center).head<2>().norm();
  const double velocity_nees = 0.5 * error * error / std::max(1e-6, o.velocity_covariance(0, 0));
  const double center_nees = 0.5 * away * away / std::max(1e-6, o.position_covariance(0, 0));
  ++score->judged;
  score->velocity_nees += velocity_nees;
  score->center_nees += center_nees;
  score->velocity_beyond += velocity_nees > kBeyond;
  score->center_beyond += center_nees > kBeyond;
  if (hits < kWholeShare * score->most_hits) {
    score->worst_hidden = std::max(score->worst_hidden, error);
    ++score->hidden_updates;
    return;
  }
  score->worst_velocity = std::max(score->worst_velocity, error);
  score->velocity_sum += error;
  ++score->updates;
}

void Score::Trace(const Shot& shot, const Obstacle& o, int owner, const std::vector<int>& hits) {
  const double t = shot.sweep.t;
  const Vector3d p = o.center.Position(t), v = o.center.Velocity(t);
  fmt::print("{:7.2f} id {} at {:6.2f} {:6.2f} v {:5.2f} {:5.2f} sigma {:.2f} {:.2f}", t,
             o.id & 0xffff, p.x(), p.y(), v.x(), v.y(), std::sqrt(o.position_covariance(0, 0)),
             std::sqrt(o.velocity_covariance(0, 0)));
  if (owner >= 0) {
    const auto k = static_cast<size_t>(owner);
    const Vector3d dp = p - shot.movers[k].solid.center, dv = v - shot.movers[k].velocity;
    fmt::print(" mover {} hits {} errors {:5.2f} {:5.2f}, {:5.2f} {:5.2f}", owner + 1, hits[k],
               dp.x(), dp.y(), dv.x(), dv.y());
  } else {
    fmt::print(" FALSE");
  }
  fmt::print(" range {:.1f}\n", (p - shot.place).head<2>().norm());
}

void Score::FollowMovers(const Shot& shot, const std::vector<Obstacle>& obstacles) {
  const double t = shot.sweep.t;
  movers.resize(shot.movers.size());
  std::vector<int> hits(movers.size(), 0);
  for (const auto& hit : shot.hits) {
    if (hit.mover < 0) continue;
    const auto k = static_cast<size_t>(hit.mover);
    ++hits[k];
    const double since = movers[k].in_sight;
    if (since < 0.0 || t - since < 0.5 || (hit.point - shot.place).head<2>().norm() > kSightRange ||
        shot.movers[k].velocity.norm() < 0.1)
      continue;
    ++mover_points;
    const Vector3d now = hit.point + (t - hit.t) * shot.movers[k].velocity;
    mover_points_held += Holder(obstacles, now, t) != nullptr;
  }
  // A listed mover stands for the nearest true one within reach, and for nothing otherwise.
  std::vector<int> owner(obstacles.size(), -1);
  bool wrong = false;
  for (size_t i = 0; i < obstacles.size(); ++i) {
    if (!obstacles[i].moving) continue;
    const Vector3d p = obstacles[i].center.Position(t);
    double best = kMatchReach;
    for (size_t k = 0; k < movers.size(); ++k) {
      const auto& solid = shot.movers[k].solid;
      const double d = world::SignedDistance(solid, {p.x(), p.y(), solid.center.z()});
      if (d < best) best = d, owner[i] = static_cast<int>(k);
    }
    wrong |= owner[i] < 0;
    if (trace_) Trace(shot, obstacles[i], owner[i], hits);
  }
  false_movers += wrong;
  for (size_t k = 0; k < movers.size(); ++k) {
    MoverScore& score = movers[k];
    const auto& truth = shot.movers[k];
    const double range = (truth.solid.center - shot.place).head<2>().norm();
    const bool moving = truth.velocity.norm() > 0.1;
    const bool visible = moving && hits[k] >= kSightHits && range <= kSightRange;
    if (visible && t - score.last_sight > kNewSight) {
      if (score.in_sight >= 0.0 && score.listed < 0.0) ++score.missed;
      score.in_sight = t;
      score.listed = -1.0;
      score.most_hits = 0;
      ++score.sights;
    }
    if (visible) score.last_sight = t;
    for (size_t i = 0; i < obstacles.size(); ++i) {
      const auto& o = obstacles[i];
      if (owner[i] != static_cast<int>(k)) continue;
      if (!visible) continue;
      score.ids.insert(o.id);
      if (score.listed < 0.0) {
        score.listed = t;
        score.worst_delay = std::max(score.worst_delay, t - score.in_sight);
      }
      score.most_hits = std::max(hits[k], static_cast<int>(0.97 * score.most_hits));
      if (t - score.listed >= 1.0) Judge(o, truth, t, hits[k], &score);
    }
  }
}

/// Where movers were 1 to 6 s ago and nothing is now, nothing may stand within 8 m of the drone.
void Score::LookForGhosts(const Shot& shot, const std::vector<Obstacle>& obstacles) {
  trails_.resize(shot.movers.size());
  bool ghost = false;
  for (size_t k = 0; k < trails_.size(); ++k) {
    auto& trail = trails_[k];
    if (shot.movers[k].velocity.norm() > 0.1 || trail.empty() ||
        (trail.back().second - shot.movers[k].solid.center).norm() > 0.01)
      trail.push_back({shot.sweep.t, shot.movers[k].solid.center});
    for (const auto& [when, p] : trail) {
      const double age = shot.sweep.t - when;
      if (age < 1.0 || age > 6.0 || (p - shot.place).head<2>().norm() > kCoverRadius) continue;
      // A mover's own length is no ghost: its place must be clear by more than that.
      if (!Free(p, shot, shot.movers[k].solid.half_size.head<2>().norm() + 0.4)) continue;
      const auto* holder = Holder(obstacles, p, shot.sweep.t);
      if (holder && trace_ && !ghost)
        fmt::print("{:7.2f} ghost of mover {} of {:.1f} s before: {} {} at {:.2f} {:.2f}\n",
                   shot.sweep.t, k + 1, age, holder->moving ? "mover id" : "static id",
                   holder->id & 0xffff, p.x(), p.y());
      ghost |= holder != nullptr;
    }
  }
  ghosts += ghost;
}

void Score::Add(const Shot& shot, const mapping::ObstacleList& list) {
  ++sweeps;
  most = std::max(most, list.n_static);
  cut += list.n_cut;
  for (const auto& hit : shot.hits) {
    if (hit.solid < 0) continue;
    const double height = hit.point.z() - Ground(hit.point);
    if (height < kLow || height > kHigh) continue;
    const auto cell = [](double x) { return static_cast<int>(std::floor(x / 0.05)); };
    Seen& seen = seen_[{cell(hit.point.x()), cell(hit.point.y()), cell(hit.point.z())}];
    ++seen.count;
    seen.point = hit.point;
  }
  FollowIds(shot, list.obstacles);
  FollowMovers(shot, list.obstacles);
  LookForGhosts(shot, list.obstacles);
  if (!course_.frozen)
    target_blocked += Holder(list.obstacles, shot.true_target.center, shot.sweep.t) != nullptr;
  if (sweeps % kEvery == 0) {
    CheckVolume(shot, list.obstacles);
    for (auto it = seen_.begin(); it != seen_.end();)  // far places have left the window
      it = (it->second.point - shot.place).head<2>().norm() > 20.0 ? seen_.erase(it) : ++it;
  }
}

void Score::Close() {
  for (auto& mover : movers)
    if (mover.in_sight >= 0.0 && mover.listed < 0.0) ++mover.missed;
}

}  // namespace chase::mapping_stage
