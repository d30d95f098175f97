#pragma once

#include "services/perception/belief/finder.h"

namespace chase::perception {

/// Sigmas of an edge from which a width tells a range, and a place across is known.
inline constexpr double kSharpSigmas = 24.0;

/// Something that may be the target, followed until it is known whether it drives or stands.
struct Candidate {
  static constexpr double kSureWay = 0.15;  ///< m, further than what shows of it may seem to go
  static constexpr int kConfirmFrames = 2;  ///< that must agree before it is believed

  TargetTrack track;
  TargetGaussian first;  ///< as it was first known well
  double since = 0.0;    ///< when it was first seen, s
  Sighting last;         ///< the last one
  double range = 0.0;    ///< from the camera when it was last seen, m
  double edge = 0.0;     ///< standard deviation of an edge of it at first, across, m
  bool ranged = false;   ///< `first` has its range from LiDAR points, not from the size alone
  /// Along the line of sight, as far as both ends of its height may err alike; frame W, m.
  Eigen::Vector2d range_error = Eigen::Vector2d::UnitX();

  bool part = false;   ///< a piece of something larger, always so far: it must drive
  double known = 0.0;  ///< time of `first`, s
  int sweeps = 0;      ///< sightings with LiDAR points

  /// Takes over a sighting at the track's time.
  void Correct(const Sighting& sighting);

  /// True when something has come before a side of what was all in view, and LiDAR still tells
  /// where it is.
  bool HiddenIn(const Sighting& sighting) const;

  /// True when it has surely moved from where it was first seen.
  bool Drives() const;
  /// True when it has gone the way that its velocity tells, as a thing does and pieces of one do
  /// not.
  bool Steady() const;
  /// True when it has also gone this way [m], further than what is seen of a standing thing may
  /// seem to.
  bool SurelyDrives(double way) const;
  /// True when its speed is no chance, with LiDAR points on it just now.
  bool Fast() const;
};

/// Something seen for the first time.
Candidate NewCandidate(const Sighting& sighting, const View& view);

}  // namespace chase::perception
