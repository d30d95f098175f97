#include "walkers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace chase::mapping_stage {

namespace {

using Eigen::Vector2d;
using world::Obstacle;

constexpr double kNear = 6.0;        // m from the drone: judged
constexpr int kViewHits = 8;         // returns of a sweep with which a walker is in view
constexpr double kWarmUp = 1.0;      // s after it was first in view and walked
constexpr double kRest = 2.0;        // s at rest after which it is static (movers.settle)
constexpr double kForgotten = 2.0;   // s out of view after which it is judged anew
constexpr double kMatch = 0.5;       // m, and two deviations, from a walker to what stands for it
constexpr double kBar = 0.3;         // m/s, m and s: velocity error, extent, reversal
constexpr double kGap = 0.2;         // s
constexpr double kHeld = 0.1;        // m beyond an obstacle: noise of a sweep
constexpr double kSweep = 0.1;       // s
constexpr double kBeside = 2.0;      // m from the target's centre to the walker's
constexpr double kBlindRange = 0.5;  // m, of the sensor
constexpr double kChange = 0.4;      // m/s, of a velocity that counts as a change of it
constexpr double kChi2 = 5.99;       // 95 % quantile of chi-squared with two axes
constexpr double kInSweep = 0.051;   // s, half a sweep: a return is that much older at the median

template <class T>
void Append(const std::vector<T>& from, std::vector<T>* to) {
  to->insert(to->end(), from.begin(), from.end());
}

double LongestSemiAxis(const Obstacle& o) {
  const Eigen::Matrix2d R = o.shape.topLeftCorner<2, 2>();
  const double mean = 0.5 * R.trace();
  return 1.0 / std::sqrt(mean - std::sqrt(std::max(0.0, mean * mean - R.determinant())));
}

}  // namespace

void WalkerFigures::Add(const WalkerFigures& o) {
  for (const auto& [to, from] : {std::pair{&listed, &o.listed},
                                 {&any_time, &o.any_time},
                                 {&held, &o.held},
                                 {&fast, &o.fast},
                                 {&slim, &o.slim},
                                 {&one_id, &o.one_id},
                                 {&reversed, &o.reversed},
                                 {&halved, &o.halved},
                                 {&stopped, &o.stopped},
                                 {&beside, &o.beside},
                                 {&hidden, &o.hidden},
                                 {&blind, &o.blind},
                                 {&velocity_honest, &o.velocity_honest},
                                 {&center_honest, &o.center_honest}})
    to->Add(*from);
  Append(o.velocity, &velocity);
  Append(o.axis, &axis);
  Append(o.acquired, &acquired);
  Append(o.bare, &bare);
  Append(o.ms, &ms);
  phantoms += o.phantoms, sweeps += o.sweeps, target_blocked += o.target_blocked;
}

std::vector<const Obstacle*> WalkerJudge::Match(const Shot& shot,
                                                const mapping::ObstacleList& list) {
  const double t = shot.sweep.t;
  std::vector<std::tuple<double, size_t, const Obstacle*>> pairs;
  bool phantom = false, blocked = false;
  for (const auto& o : list.obstacles) {
    if (!o.moving) continue;
    double nearest = INFINITY;
    for (size_t k = 0; k < shot.movers.size(); ++k) {
      const double d = (o.center.Position(t) - shot.movers[k].solid.center).head<2>().norm();
      nearest = std::min(nearest, d);
      if (d < kMatch + 2.0 * std::sqrt(o.position_covariance(0, 0))) pairs.emplace_back(d, k, &o);
    }
    const double range = (o.center.Position(t) - shot.place).head<2>().norm();
    if (nearest > 1.0 && range < kNear) {
      phantom = true;
      if (trace_)
        fmt::print(
            "{:7.2f} phantom id {} at {:.1f} m of the drone, {:.1f} m from any, exists {:.2f}\n", t,
            o.id & 0xffff, range, nearest, o.existence);
    }
    blocked |= o.SquaredDistance(shot.true_target.center, t) < 1.0;
  }
  ++figures.sweeps;
  figures.phantoms += phantom;
  figures.target_blocked += blocked;
  std::sort(pairs.begin(), pairs.end());
  std::vector<const Obstacle*> of(shot.movers.size(), nullptr);
  std::set<const Obstacle*> taken;
  for (const auto& [d, k, o] : pairs)
    if (!of[k] && taken.insert(o).second) of[k] = o;
  return of;
}

void WalkerJudge::EndSighting(Walker* w) {
  if (w->seen_near && !w->ids.empty()) figures.one_id.Add(w->ids.size() == 1);
  if (trace_ && w->ids.size() > 1)
    fmt::print("        sighting of walker {} had {} ids\n", w - walkers_.data() + 1,
               w->ids.size());
  w->ids.clear();
  w->seen_near = false;
  w->began = w->listed = -1.0;
}

/// Held: the middle of its returns is within or next to an obstacle of any kind.
void WalkerJudge::JudgeHeld(const Shot& shot, const mapping::ObstacleList& list, size_t k) {
  const double t = shot.sweep.t;
  const auto& truth = shot.movers[k];
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();
  double age = 0.0;
  int hits = 0;
  for (const auto& hit : shot.hits)
    if (hit.mover == static_cast<int>(k)) seen += hit.point, age += t - hit.t, ++hits;
  Walker& w = walkers_[k];
  const bool judged =
      hits >= kViewHits && (truth.solid.center - shot.place).head<2>().norm() <= kNear;
  if (judged) seen /= hits, age /= hits;
  const bool held =
      judged && std::any_of(list.obstacles.begin(), list.obstacles.end(), [&](const Obstacle& o) {
        const Eigen::Vector3d d =
            seen + (o.moving ? age : 0.0) * truth.velocity - o.center.Position(t);
        return !o.ground && d.dot(world::Inflated(o.shape, kHeld) * d) <= 1.0;
      });
  if (judged) figures.held.Add(held);
  if (judged && !held) w.bare += kSweep;
  if (trace_ && judged && !held)
    fmt::print("{:7.2f} walker {} BARE range {:.1f} hits {} speed {:.2f} beside {:.1f}\n", t, k + 1,
               (truth.solid.center - shot.place).head<2>().norm(), hits, truth.velocity.norm(),
               (truth.solid.center - shot.true_target.center).head<2>().norm());
  if (w.bare > 0.0 && (!judged || held)) figures.bare.push_back(std::exchange(w.bare, 0.0));
}

/// An interval counts when the walker was listed in the sweep before it; what follows within
/// `slack` s belongs to it.
void WalkerJudge::Step(double t, bool inside, bool listed, bool listed_before, double slack,
                       Spell* s) {
  if (inside && !s->open) *s = {true, listed_before, false, t, t, t - kSweep, 0.0};
  if (!s->open) return;
  if (inside) s->until = t;
  if (listed) s->listed = t;
  s->gap = std::max(s->gap, t - s->listed);
  s->over = t - s->until >= slack;
}

void WalkerJudge::Close(Spell* s, const char* name, double longest, Share* share) const {
  if (!s->open || !s->over) return;
  s->open = false;
  if (!s->was_listed || s->until - s->from > longest) return;
  share->Add(s->gap < kGap + 1e-6);
  if (trace_ && s->gap > kGap + 1e-6)
    fmt::print("        {} {:.1f} to {:.1f}: gap {:.1f} s\n", name, s->from, s->until, s->gap);
}

void WalkerJudge::JudgeMotion(double t, const world::MoverState& truth, const Obstacle& o,
                              Walker* w) {
  const Vector2d dv = (o.center.Velocity(t) - truth.velocity).head<2>();
  const Vector2d dp = (o.center.Position(t) - truth.solid.center).head<2>();
  const double longest = LongestSemiAxis(o) - truth.solid.half_size.head<2>().maxCoeff();
  figures.slim.Add(longest <= kBar);
  figures.axis.push_back(longest);
  figures.velocity_honest.Add(dv.squaredNorm() < kChi2 * o.velocity_covariance(0, 0));
  figures.center_honest.Add(dp.squaredNorm() < kChi2 * o.position_covariance(0, 0));
  if (t - w->changed < kBar) return;
  figures.fast.Add(dv.norm() <= kBar);
  figures.velocity.push_back(dv.norm());
}

/// A change counts when the walker was listed at the last sweep before it and is in view all the
/// time.
void WalkerJudge::JudgeChange(double t, const world::MoverState& truth, const Obstacle* o,
                              bool judged, Walker* w) {
  const Vector2d v = truth.velocity.head<2>();
  if ((v - w->v).norm() > kChange) {
    w->before = w->v;
    w->changed = t - kInSweep;
    w->open_change = judged && w->was_listed;
    w->followed = w->half = false;
  }
  w->v = v;
  if (!w->open_change) return;
  if (!judged) w->open_change = false;
  if (t - w->changed < kBar + 1e-6 && o) {
    const Vector2d seen = o->center.Velocity(t).head<2>();
    w->followed |= (seen - v).norm() <= kBar;
    w->half |= (seen - v).norm() < (seen - w->before).norm();
  }
  if (!w->open_change || t - w->changed < kBar + 1e-6) return;
  w->open_change = false;
  if (v.dot(w->before) < -0.5 * v.norm() * w->before.norm()) {
    figures.reversed.Add(w->followed);
    figures.halved.Add(w->half);
  } else {
    figures.stopped.Add(w->followed);
  }
}

void WalkerJudge::Follow(const Shot& shot, size_t k, int hits, const Obstacle* o) {
  const double t = shot.sweep.t;
  const auto& truth = shot.movers[k];
  Walker& w = walkers_[k];
  const Vector2d p = truth.solid.center.head<2>();
  const double range = (p - shot.place.head<2>()).norm();
  const bool in_view = hits >= kViewHits;
  const bool walks = truth.velocity.norm() > 0.1;
  if (walks) w.walked = t;
  const bool rests = t - w.walked > kRest;
  if (w.began >= 0.0 && (rests || t - w.in_view > kForgotten)) EndSighting(&w);
  if (in_view) w.in_view = t;
  if (w.began < 0.0 && in_view && walks) w.began = t;
  const bool warm = w.began >= 0.0 && t - w.began >= kWarmUp - 1e-6;
  const bool near = range <= kNear;
  if (o && w.began >= 0.0 && w.listed < 0.0) {
    w.listed = t;
    if (near) figures.acquired.push_back(t - w.began);
  }
  const bool judged = warm && near && in_view && !rests;
  if (w.began >= 0.0 && near && in_view) {
    figures.any_time.Add(o != nullptr);
    w.seen_near = true;
    if (o) w.ids.insert(o->id);
  }
  JudgeChange(t, truth, o, judged, &w);
  if (judged) {
    figures.listed.Add(o != nullptr);
    if (o) JudgeMotion(t, truth, *o, &w);
  }
  const double aside = (p - shot.true_target.center.head<2>()).norm();
  if (trace_ && judged) {
    fmt::print(
        "{:7.2f} walker {} {} at {:.2f} {:.2f} range {:.1f} hits {} beside {:.1f} speed {:.2f}", t,
        k + 1, o ? "listed" : "MISSED", p.x(), p.y(), range, hits, aside, truth.velocity.norm());
    if (o) {
      const Eigen::Vector3d dp = o->center.Position(t) - truth.solid.center,
                            v = o->center.Velocity(t);
      fmt::print(
          " id {} dp {:.2f} {:.2f} v {:.2f} {:.2f} for {:.2f} {:.2f} sigma {:.2f} {:.2f} axis "
          "{:.2f}",
          o->id & 0xffff, dp.x(), dp.y(), v.x(), v.y(), truth.velocity.x(), truth.velocity.y(),
          std::sqrt(o->position_covariance(0, 0)), std::sqrt(o->velocity_covariance(0, 0)),
          LongestSemiAxis(*o) - truth.solid.half_size.x());
    }
    fmt::print("\n");
  }
  const bool usable = warm && near && !rests;
  const bool blind = range < kBlindRange + truth.solid.half_size.x() + 0.1;
  Step(t, usable && !in_view && blind, o != nullptr, w.was_listed, kBar, &w.blind);
  Step(t, usable && !in_view && !blind, o != nullptr, w.was_listed, kBar, &w.hidden);
  Step(t, usable && aside < kBeside, o != nullptr, w.was_listed, 0.05, &w.beside);
  Close(&w.blind, "blind", kForgotten, &figures.blind);
  Close(&w.hidden, "hidden", kForgotten, &figures.hidden);
  Close(&w.beside, "beside", INFINITY, &figures.beside);
  w.was_listed = o != nullptr;
}

void WalkerJudge::Add(const Shot& shot, const mapping::ObstacleList& list) {
  walkers_.resize(shot.movers.size());
  std::vector<int> hits(shot.movers.size(), 0);
  for (const auto& hit : shot.hits)
    if (hit.mover >= 0) ++hits[static_cast<size_t>(hit.mover)];
  const auto of = Match(shot, list);
  for (size_t k = 0; k < shot.movers.size(); ++k) {
    Follow(shot, k, hits[k], of[k]);
    JudgeHeld(shot, list, k);
  }
}

void WalkerJudge::Close() {
  for (auto& w : walkers_)
    if (w.began >= 0.0) EndSighting(&w);
}

Course Behind(const world::Scenario& scenario) {
  constexpr double kStep = 0.05;  // s
  Course course;
  course.scenario = scenario;
  course.name = scenario.name;
  course.duration = scenario.duration_s;
  const auto path = world::TargetMotion(scenario);
  // The way: from the drone's start to the target's, and on as the target goes.
  std::vector<std::pair<double, Vector2d>> way = {{0.0, scenario.chaser.start.head<2>()}};
  std::vector<double> travelled;  // by the target, along that way
  for (double t = 0.0; t < course.duration + 1.0; t += kStep) {
    const Vector2d p = path.Position(t);
    const double s = way.back().first + (p - way.back().second).norm();
    if (s > way.back().first) way.emplace_back(s, p);
    travelled.push_back(way.back().first);
  }
  const double distance = scenario.chaser.desired_distance;
  const auto along = [way](double s) -> Vector2d {
    const auto after = std::lower_bound(way.begin(), way.end(), s,
                                        [](const auto& a, double b) { return a.first < b; });
    if (after == way.begin()) return way.front().second;
    if (after == way.end()) return way.back().second;
    const auto& [s1, p1] = *after;
    const auto& [s0, p0] = *(after - 1);
    return p0 + (s - s0) / (s1 - s0) * (p1 - p0);
  };
  const auto ground = scenario.world.ground;
  course.place = [=](double t) -> Eigen::Vector3d {
    Vector2d p = Vector2d::Zero();
    for (int i = 0; i < 8; ++i) {
      const double index =
          std::clamp((t + 0.1 * (i - 3.5)) / kStep, 0.0, static_cast<double>(travelled.size() - 1));
      p += 0.125 * along(travelled[static_cast<size_t>(index)] - distance);
    }
    return {p.x(), p.y(),
            world::GroundHeight(ground, p.x(), p.y()) + 1.2 + 0.2 * std::sin(0.6 * t)};
  };
  return course;
}

}  // namespace chase::mapping_stage
