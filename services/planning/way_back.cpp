#include "services/planning/way_back.h"

#include <algorithm>

namespace chase::planning {

namespace {

using Eigen::Vector3d;

constexpr double kReach = 8.0;          // m of a leg: the map is surely known that far
constexpr std::size_t kMostTried = 12;  // goals of one leg, so that a plan takes its time at most
constexpr double kAtHome = 1.0;         // m: the trail's first points, the climb among them
constexpr double kStride = 1.0;         // m between places where there is no trail
constexpr double kLevel = 0.1;          // m between heights that differ

/// Where a leg may end, at whatever height, by the order on the way: home, then the trail.
std::vector<std::size_t> InReach(const std::vector<Vector3d>& way, const Vector3d& p) {
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < way.size(); ++i)
    if ((way[i] - p).head<2>().norm() < kReach) near.push_back(i);
  const std::size_t every = near.size() / kMostTried + 1;
  std::vector<std::size_t> tried;
  for (std::size_t i = 0; i < near.size(); i += every) tried.push_back(near[i]);
  return tried;
}

std::vector<Vector3d> Way(const Trail& trail, const Vector3d& home) {
  std::vector<Vector3d> way = {home};
  for (const Vector3d& p : trail.points()) {
    const bool climbs = (p - home).head<2>().norm() < kAtHome && p.z() < home.z() + kAtHome;
    if (climbs) continue;
    const double gap = way.size() == 1 ? (p - home).norm() : 0.0;
    if (gap > kAtHome + kStride)
      for (double d = kStride; d < gap; d += kStride) way.push_back(home + d / gap * (p - home));
    way.push_back(p);
  }
  return way;
}

}  // namespace

void Trail::Add(const Vector3d& p) {
  if (!points_.empty() && (points_.back() - p).norm() < kSpacing) return;
  // Back at a place where it was: the loop since then leads nowhere.
  const auto met = std::find_if(points_.begin(), points_.end(),
                                [&](const Vector3d& q) { return (q - p).norm() < kSpacing; });
  if (met != points_.end())
    points_.erase(met + 1, points_.end());
  else if (points_.size() < kMost)
    points_.push_back(p);
}

std::optional<Stop> WayBack::Leg(const PlannerConfig& config, const PlanRequest& request,
                                 const Trail& trail, const Vector3d& home,
                                 const world::Trajectory* flown, const MayFly& may_fly) {
  if (flown == nullptr) goal_.reset();
  const std::vector<Vector3d> way = Way(trail, home);
  const std::vector<std::size_t> goals = InReach(way, request.start.p);
  const auto to = [&](const Vector3d& p) {
    std::optional<Stop> leg = GoTo(config, request, p);
    return leg && may_fly(leg->trajectory) ? std::move(leg) : std::nullopt;
  };
  // Down no steeper than the LiDAR sees; level where neither that nor a climb can be certified.
  const auto try_goal = [&](std::size_t i) {
    const Vector3d& p = request.start.p;
    Vector3d end = way[i];
    end.z() = std::max(end.z(), p.z() - kSightSlope * (end - p).head<2>().norm());
    std::optional<Stop> leg = to(end);
    if (!leg && std::abs(end.z() - p.z()) > kLevel) leg = to({end.x(), end.y(), p.z()});
    if (leg) goal_ = i;
    return leg;
  };
  // Farther on, if that is possible now; else on; else anywhere along the way.
  for (const std::size_t i : goals)
    if (goal_ && i < *goal_)
      if (auto leg = try_goal(i)) return leg;
  if (goal_)
    if (auto leg = GoOn(config, request, *flown); leg && may_fly(leg->trajectory)) return leg;
  for (const std::size_t i : goals)
    if (!goal_ || i >= *goal_)
      if (auto leg = try_goal(i)) return leg;
  goal_.reset();
  return std::nullopt;
}

}  // namespace chase::planning
