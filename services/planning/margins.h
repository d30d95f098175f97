#pragma once

#include <string>

#include "services/planning/candidate_set.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// Squared distances to ellipsoids beyond which nothing is close; as a factor of lengths more than
/// enough.
inline constexpr double kClear = 1.02;
/// 1/m^2, of a shape that sorts out nothing.
inline constexpr double kPoint = 1e6;
/// tau by which a plan has left an obstacle that it starts in.
inline constexpr double kLeaveBy = 0.25;

inline double SquaredNorm(const Eigen::Matrix3d& R, const Eigen::Vector3d& x) {
  return x.dot(R * x);
}

/// The ellipsoid that sorts out candidates before the proof looks at the solid. Within a box, whose
/// faces it touches: about a wall of 4 m it would reach 1.5 m beyond its ends and close doors.
inline Eigen::Matrix3d SortingShape(const world::Obstacle& o, const Ellipsoid& e) {
  if (!e.body || o.solid != world::Obstacle::Solid::kBox) return o.shape;
  const Eigen::Matrix3d R = o.axes.toRotationMatrix();
  return R * o.half.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
}

/// What the ellipsoids are grown by, m.
struct Growth {
  double safety, sight;
};

/// A curve and boxes around it and its quarters, where its degree allows them.
struct Hull {
  static constexpr int kQuarters = 4;
  const Curve& curve;
  bool has_boxes;
  Box whole, quarters[kQuarters];

  explicit Hull(const Curve& curve);
};

/// A quick sufficient test that the curve stays well out.
bool IsPlainlyOutside(const Hull& curve, const Curve& center, const Eigen::Array3d& half);
/// At sampled instants.
bool StaysOutside(const Curve& curve, const Curve& center, const Eigen::Matrix3d& R, double limit);

/// The line of sight at the start and a box around it.
struct FirstSight {
  Eigen::Vector3d p, q;
  Box box;

  explicit FirstSight(const Problem& problem);
  bool IsBeyond(const Curve& center, const Eigen::Matrix3d& R, const Eigen::Array3d& half,
                double limit) const;
};

/// Margins that give way at the start: whether the drone, or its line of sight, is clear of the
/// obstacle there.
class StartCheck {
 public:
  explicit StartCheck(const Problem& problem);
  bool IsSafe(const Ellipsoid& e, double radius);
  bool IsInSight(const Ellipsoid& e, double share);
  const Curve& curve() const { return problem_.start; }

 private:
  // Off by a little more than nothing, so that a plan can be, too.
  bool IsOff(const Ellipsoid& e, const world::Ball* target);

  const Problem& problem_;
  world::Ball start_, seen_;
};

/// The ellipsoid only sorts candidates out before the proof looks at the solid. Where it holds a
/// start that is off the solid, none would be left: there it is smaller, or sorts out nothing.
void ClearStart(const world::Obstacle& o, double growth, const Curve& start, Ellipsoid* e);

/// Takes the margin, never the hard radius, back until the start is outside. `searched`: by
/// ellipsoids too.
void RelaxSafety(const world::Obstacle& o, double hard, double margin, double uncertainty,
                 bool searched, StartCheck* start, Ellipsoid* e, std::string* notes);

/// The largest share of the margin that the target keeps out of, and the line of sight at the start
/// too, where it keeps out of any.
void RelaxSight(const world::Obstacle& o, const Growth& growth, const FirstSight& first,
                const Hull& target, const Problem& problem, StartCheck* start, Ellipsoid* e,
                std::string* notes);

/// Adds a clause to the notes, if there are any.
void Note(std::string* notes, const std::string& text);

}  // namespace chase::planning
