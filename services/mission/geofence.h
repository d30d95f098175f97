#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace chase::mission {

/// Where it may fly: a polygon seen from above and two heights, all counted from the take-off place
/// along the axes of frame W. No corners: anywhere.
struct Geofence {
  std::vector<Eigen::Vector2d> polygon;  ///< m, in order; edges do not cross
  double floor = -1.0;                   ///< m
  double ceiling = 30.0;                 ///< m

  template <class V>
  void Visit(V& v) {
    v("polygon", polygon,
      "corners from above, m from the take-off place along x and y; none: no fence");
    v("floor", floor, "height above the take-off place, at least, m");
    v("ceiling", ceiling, "height above the take-off place, at most, m");
  }
  bool Exists() const { return !polygon.empty(); }
  /// Why a place is outside, `p` in m from the take-off place; empty: it is inside.
  std::string Breach(const Eigen::Vector3d& p) const;
  std::string Problem() const;
};

}  // namespace chase::mission
