#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/world/trajectory.h"

namespace chase::world {

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
  /// Why a place is outside, or nearer to the fence than `margin` m, `p` in m from the take-off
  /// place; empty: it is inside.
  std::string Breach(const Eigen::Vector3d& p, double margin = 0.0) const;
  /// Why a body at `p` is not to be led along `places`, all counted from the take-off place, m;
  /// empty: it may be. Inside they keep `margin` m off the fence; one that is nearer to it, or
  /// starts there, is led inside to where there is more room; one that is outside only nearer.
  std::string Refusal(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& places,
                      double margin) const;
  std::string Problem() const;

 private:
  /// Distance to the fence, m; outside it is negative.
  double Room(const Eigen::Vector3d& p) const;
};

/// Places, frame W, m, on a plan up to its stop and along that to rest: where it is flown if
/// nothing more comes. At most 0.05 s apart on plans of up to 50 s.
std::vector<Eigen::Vector3d> PlacesOn(const Trajectory& plan,
                                      const std::optional<Trajectory>& stop);

}  // namespace chase::world
