#include "services/mission/geofence.h"

#include <algorithm>

namespace chase::mission {
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

}  // namespace

std::string Geofence::Breach(const Eigen::Vector3d& p) const {
  if (!Exists()) return "";
  if (!p.allFinite() || !IsWithin(polygon, p.head<2>())) return "outside the geofence";
  if (p.z() < floor) return "below the geofence";
  return p.z() > ceiling ? "above the geofence" : "";
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

}  // namespace chase::mission
