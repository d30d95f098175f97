#pragma once

#include <optional>
#include <vector>

#include "common/world/separation_check.h"

namespace chase::world {

enum class Kept {
  kOff,        ///< proven: `certificate` holds
  kTouches,    ///< at `tau` a point of the segment is nearer than the radius, to a nanometre
  kUndecided,  ///< neither, in an interval of 2^-14 that holds `tau`
};

struct SeparationResult {
  Kept kept = Kept::kUndecided;
  Certificate certificate;  ///< in order, covers [from, to]; only with kOff
  Rooms room{0.0, 0.0};     ///< least that it proves beyond the radii
  double tau = 0.0;
};

/// Planes that keep bodies away from the drone's ball, or from the hull of the drone's and the
/// target's ball where there is a `target`, for tau in [from, to] (all of it in [0,1]). The plane
/// across the line between their means is tried first. An interval gets the plane between the body
/// and the nearest point of the hull of all control points there, and is halved where there is
/// none. What is returned as kOff has passed IsCertificate.
class Separator {
 public:
  /// Keeps pointers to the balls.
  Separator(const Ball& drone, const Ball* target, double from = 0.0, double to = 1.0);

  /// To be called when the balls' radii have changed.
  void TakeRadii();
  SeparationResult From(const Body& body);

 private:
  struct Party {
    SweptBall ball;
    Eigen::Vector3d mean;  ///< of the centre
  };
  Party MakeParty(const Ball& ball) const;
  Eigen::Vector3d Between(const Body& body) const;

  double from_, to_;
  Party drone_;
  std::optional<Party> target_;
  Eigen::Vector3d along_;  ///< from the drone's mean to the target's, where there is one, m
  double length_ = 0.0;    ///< its square
};

/// The same for one body.
SeparationResult Separate(const Ball& drone, const Ball* target, const Body& body,
                          double from = 0.0, double to = 1.0);

/// Is at `tau` a point of the segment nearer to the body than the radius, by a nanometre at least?
bool Touch(const Ball& drone, const Ball* target, const Body& body, double tau);

}  // namespace chase::world
