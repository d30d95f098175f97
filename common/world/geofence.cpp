#include "common/world/geofence.h"

#include <algorithm>
#include <cmath>

namespace chase::world {
namespace {

/// Even-odd rule: does a ray along x from p cross the edges an odd number of times?
bool IsWithin(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    const double x = a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (p.x() < x) inside = !inside;
  }
  return inside;
}

/// Distance from p to the nearest edge, m.
double ToEdges(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  double least = HUGE_VAL;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d ab = polygon[(i + 1) % polygon.size()] - a;
    const double along = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12), 0.0, 1.0);
    least = std::min(least, (p - a - along * ab).norm());
  }
  return least;
}

void Sample(const Trajectory& path, double to, std::vector<Eigen::Vector3d>* places) {
  constexpr double kLeast = 20.0, kMost = 1000.0, kStep = 0.05;  // places; s
  const int n = static_cast<int>(std::clamp(std::ceil((to - path.start) / kStep), kLeast, kMost));
  for (int i = 0; i <= n; ++i)
    places->push_back(path.Position(path.start + (to - path.start) * i / n));
}

}  // namespace

std::vector<Eigen::Vector3d> PlacesOn(const Trajectory& plan,
                                      const std::optional<Trajectory>& stop) {
  std::vector<Eigen::Vector3d> places;
  Sample(plan, stop ? stop->start : plan.end(), &places);
  if (stop) Sample(*stop, stop->end(), &places);
  return places;
}

std::string Geofence::Breach(const Eigen::Vector3d& p, double margin) const {
  if (!Exists()) return "";
  if (!p.allFinite() || !IsWithin(polygon, p.head<2>())) return "outside the geofence";
  if (margin > 0.0 && ToEdges(polygon, p.head<2>()) < margin) return "too near to the geofence";
  if (p.z() - margin < floor) return "below the geofence";
  return p.z() + margin > ceiling ? "above the geofence" : "";
}

double Geofence::Room(const Eigen::Vector3d& p) const {
  const double level = ToEdges(polygon, p.head<2>());
  return std::min(
      {IsWithin(polygon, p.head<2>()) ? level : -level, p.z() - floor, ceiling - p.z()});
}

std::string Geofence::Refusal(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& places,
                              double margin) const {
  const bool near = !Breach(p, margin).empty() || !Breach(places.front(), margin).empty();
  const bool outside = !Breach(p).empty();
  if (near && Room(places.back()) <= Room(p)) return "it leads no way back into the geofence";
  if (outside) return "";
  for (const Eigen::Vector3d& place : places)
    if (std::string breach = Breach(place, near ? 0.0 : margin); !breach.empty())
      return "it leads " + breach;
  return "";
}

std::string Geofence::Problem() const {
  if (!Exists()) return "";
  if (polygon.size() < 3) return "polygon has fewer than 3 corners";
  for (const Eigen::Vector2d& corner : polygon)
    if (!corner.allFinite()) return "polygon has a corner that is not finite";
  if (!(floor < 0.0)) return "floor is not below 0 m, where it takes off";
  if (!(ceiling > 0.0)) return "ceiling is not above 0 m, where it takes off";
  if (!IsWithin(polygon, Eigen::Vector2d::Zero()))
    return "polygon does not hold the take-off place, [0, 0]";
  return "";
}

}  // namespace chase::world
