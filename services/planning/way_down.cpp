#include "services/planning/way_down.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/world/column.h"

namespace chase::planning {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSpacing = 0.5;    // m between places that are looked at
constexpr int kMostTried = 12;      // ways, so that a plan takes its time at most
constexpr double kUnknownDrop = 5;  // m below the body that are looked at where no ground is listed
constexpr double kAtHome = 0.3;     // m: as near as a return comes
constexpr double kSame = 0.01;      // m

/// The ground, or a thing on it, as far as it is known to be under a place.
struct Below {
  double low = HUGE_VAL, high = -HUGE_VAL;  ///< m
  bool known = true;
};

/// Adds the slabs' middle planes, which are the ground, at (x, y).
void Add(const std::vector<world::Obstacle>& obstacles, const Vector2d& xy, Below* below) {
  bool covered = false;
  for (const world::Obstacle& o : obstacles) {
    if (!o.ground || o.solid != world::Obstacle::Solid::kBox) continue;
    const Vector3d c = o.center.Position(o.center.start), n = o.axes * Vector3d::UnitZ();
    if (n.z() < 0.1) continue;
    const Vector2d d = xy - c.head<2>();
    const Vector3d on(d.x(), d.y(), -n.head<2>().dot(d) / n.z());
    const Vector3d local = o.axes.conjugate() * on;
    if (std::abs(local.x()) > o.half.x() || std::abs(local.y()) > o.half.y()) continue;
    below->low = std::min(below->low, c.z() + on.z());
    below->high = std::max(below->high, c.z() + on.z());
    covered = true;
  }
  below->known = below->known && covered;
}

/// The middle of a disc, and what lies around it.
struct Disc {
  Below middle, all;

  /// Of the ground from the middle to anywhere, m.
  double Rise() const { return std::max(all.high - middle.low, middle.high - all.low); }
};

Disc Under(const std::vector<world::Obstacle>& obstacles, const Vector2d& xy, double radius) {
  constexpr int kAround = 8;
  Disc disc;
  Add(obstacles, xy, &disc.middle);
  disc.all = disc.middle;
  for (const double share : {0.5, 1.0})
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2.0 * M_PI * i / kAround;
      const Vector2d d(std::cos(angle), std::sin(angle));
      Add(obstacles, xy + share * radius * d, &disc.all);
    }
  return disc;
}

/// By distance: rings of places.
std::vector<Vector2d> Around(double reach) {
  std::vector<Vector2d> all;
  for (double r = kSpacing; r <= reach; r += kSpacing) {
    const int n = static_cast<int>(std::ceil(2.0 * M_PI * r / kSpacing));
    for (int i = 0; i < n; ++i) {
      const double angle = 2.0 * M_PI * i / n;
      all.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
  }
  return all;
}

/// One look for a place, from p_WB = `rest`.
class Survey {
 public:
  Survey(const PlanRequest& request, const LandingNeeds& needs, const Vector3d& rest,
         const std::optional<Vector3d>& home)
      : obstacles_(request.obstacles), needs_(needs), rest_(rest), home_(home) {
    if (request.target_body) obstacles_.push_back(*request.target_body);
    if (const auto ground = GroundAt(obstacles_, rest.head<2>())) above_ = rest.z() - *ground;
  }

  Footing At(const Vector3d& p) const {
    const Footing footing = FootingAt(obstacles_, needs_, p);
    const bool borne = home_ && (p - *home_).head<2>().norm() < kAtHome;
    return borne && footing != Footing::kTaken ? Footing::kLevel : footing;
  }

  /// As high above the ground as it is now.
  Vector3d Above(const Vector2d& xy) const {
    const std::optional<double> ground = GroundAt(obstacles_, xy);
    return {xy.x(), xy.y(), ground && above_ ? *ground + *above_ : rest_.z()};
  }

 private:
  std::vector<world::Obstacle> obstacles_;
  const LandingNeeds& needs_;
  Vector3d rest_;
  const std::optional<Vector3d>& home_;
  std::optional<double> above_;  // the ground, m
};

std::string Words(Footing footing, double way) {
  char text[80];
  std::snprintf(
      text, sizeof text, "%s %.1f m away",
      footing == Footing::kLevel ? "to level ground" : "no level ground is known: to a free place",
      way);
  return text;
}

}  // namespace

std::optional<double> GroundAt(const std::vector<world::Obstacle>& obstacles, const Vector2d& xy) {
  Below below;
  Add(obstacles, xy, &below);
  return below.known ? std::optional(below.high) : std::nullopt;
}

Footing FootingAt(const std::vector<world::Obstacle>& obstacles, const LandingNeeds& needs,
                  const Vector3d& p) {
  const Disc disc = Under(obstacles, p.head<2>(), needs.radius);
  const double down = disc.all.known ? std::max(0.0, p.z() - disc.all.low) : kUnknownDrop;
  const Vector3d foot = p - down * Vector3d::UnitZ();
  if (world::IsColumnBlocked(obstacles, foot, needs.radius, down)) return Footing::kTaken;
  if (!disc.all.known) return Footing::kUnknown;
  return disc.Rise() <= needs.radius * needs.most_slope ? Footing::kLevel : Footing::kUneven;
}

WayDown::Answer WayDown::Lead(const PlannerConfig& config, const PlanRequest& request,
                              const LandingNeeds& needs, const Vector3d& rest,
                              const std::optional<Vector3d>& home, const world::Trajectory* flown,
                              const MayFly& may_fly) {
  const Survey survey(request, needs, rest, home);
  const auto to = [&](const Vector3d& spot) -> std::optional<Stop> {
    const bool led = flown && (flown->Position(flown->end()) - spot).norm() < kSame;
    if (led)
      if (auto leg = GoOn(config, request, *flown); leg && may_fly(leg->trajectory)) return leg;
    std::optional<Stop> leg = GoTo(config, request, spot);
    if (leg && !may_fly(leg->trajectory)) leg.reset();
    return leg;
  };
  const auto way = [&](const Vector3d& spot) { return (spot - request.start.p).head<2>().norm(); };
  const Footing here = survey.At(rest);
  if (spot_) {
    const Footing there = survey.At(*spot_);
    if (there > here || there == Footing::kLevel)
      if (auto leg = to(*spot_)) return {std::move(leg), Words(there, way(*spot_))};
    spot_.reset();
  }
  if (here == Footing::kLevel) return {std::nullopt, "on level ground"};
  const std::vector<Vector2d> places = Around(needs.reach);
  for (const Footing asked : {Footing::kLevel, Footing::kUnknown}) {
    if (asked == Footing::kUnknown && here != Footing::kTaken) break;
    int tried = 0;
    for (const Vector2d& d : places) {
      const Vector3d spot = survey.Above(rest.head<2>() + d);
      const Footing there = survey.At(spot);
      if (asked == Footing::kLevel ? there != Footing::kLevel : there == Footing::kTaken) continue;
      if (auto leg = to(spot)) {
        spot_ = spot;
        return {std::move(leg), Words(there, way(spot))};
      }
      if (++tried == kMostTried) break;
    }
  }
  return {std::nullopt, "no level ground is known: here"};
}

}  // namespace chase::planning
