#pragma once

#include "services/perception/belief/finder.h"

namespace chase::perception {

/// Sigmas of an edge from which a width tells a range, and a place across is known.
inline constexpr double kSharpSigmas = 24.0;

/// Where something was known to be at one time; frame W.
struct Placed {
  double t = 0.0;                                        ///< s
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();        ///< the camera, m
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();        ///< m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< with what all edges err by alike, m^2
  bool ranged = false;      ///< LiDAR points tell its range, not the size alone
  double edge_share = 0.0;  ///< standard deviation of an edge, share of its height
};

/// Something that may be the target, followed until it is known whether it drives or stands.
struct Candidate {
  static constexpr double kSureWay = 0.15;  ///< m, further than what shows of it may seem to go
  static constexpr int kConfirmFrames = 2;  ///< that must agree before it is believed

  TargetTrack track;
  Placed first;        ///< as it was first known well
  double since = 0.0;  ///< when it was first seen, s
  Sighting last;       ///< the last one
  double edge = 0.0;   ///< standard deviation of an edge of it at first, across, m
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();  ///< the camera then, frame W, m

  bool part = false;  ///< a piece of something larger, always so far: it must drive
  int sweeps = 0;     ///< sightings of all of it that LiDAR surely hit
  double odds =
      0.0;  ///< mean of its sightings' log odds, but for the first, which it was placed on

  /// Takes over a sighting at the track's time by a camera at p_WC.
  void Correct(const Sighting& sighting, const Eigen::Vector3d& camera);
  /// From the camera when it was last seen, m.
  double Range() const { return (track.state.position() - p_WC).norm(); }

  Placed Now() const;
  /// From where it was first known, m.
  Eigen::Vector2d Way() const { return (track.state.position() - first.p_WT).head<2>(); }

  /// Logarithm of how much likelier its way is if it drives than if it stands.
  double LogDrives() const;
  /// Of anything else in its place, by its shape.
  double OddsAgainst() const;
  /// True when it is surely of the target's shape.
  bool Alike() const;
  /// That it is the target and drives, rather than something of another shape or its like that
  /// stands.
  double Probability() const;
  /// True when it has surely moved from where it was first known.
  bool Drives() const;
  /// True when it has gone the way that its velocity tells, as a thing does and pieces of one do
  /// not.
  bool Steady() const;
  /// True when it has also gone this way [m], further than what is seen of a standing thing may
  /// seem to.
  bool SurelyDrives(double way) const;
};

/// Something seen for the first time.
Candidate NewCandidate(const Sighting& sighting, const View& view);

}  // namespace chase::perception
