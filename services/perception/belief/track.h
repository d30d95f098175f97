#pragma once

#include <Eigen/Core>
#include <limits>

#include "services/perception/place/target_fit.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

inline constexpr double kHiddenTime = 3.0;    ///< s over which what is not seen may stop or turn
inline constexpr double kGroundSigma = 0.15;  ///< m that the ground rises or falls meanwhile

/// One thing found in one frame.
struct Sighting {
  FitResult fit;
  Detection detection;

  /// True when LiDAR points tell that it is one thing.
  bool SurelyHit() const { return fit.n_points >= kSurelyHit; }
};

/// Where something was known to be at one time; frame W.
struct Placed {
  double t = 0.0;                                  ///< s
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();  ///< the camera, m
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();  ///< m
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  ///< with what errs alike in all frames, m^2
  double edge_share = 0.0;      ///< standard deviation of an edge, share of its height
  bool rangeless = false;       ///< a piece of it, and few LiDAR points: its range is not known
};

/// One thing that may be the target, followed from frame to frame: the target, candidates and
/// look-alikes alike.
struct Track {
  TargetGaussian state;  ///< at time t
  TargetShape shape;
  double t = 0.0;     ///< s
  double seen = 0.0;  ///< time of the last correction, s
  int hits = 0, misses = 0;
  bool partial = false;  ///< something hid part of it whenever it was seen
  bool part = false;     ///< a piece of something larger, always so far
  bool driven = false;   ///< it has been seen to drive
  double ranged = -std::numeric_limits<double>::infinity();  ///< when LiDAR last hit it, s
  double since = 0.0;                                        ///< when it was first seen, s
  Placed first;                                              ///< as it was first known well
  Sighting last;
  Eigen::Vector3d p_WC = Eigen::Vector3d::Zero();  ///< the camera then, frame W, m
  bool sized = false;  ///< LiDAR has surely hit all of it, or the detector measures its place
  double odds = 0.0;   ///< mean of its sightings' log odds, but for the first, which placed it

  /// Constant velocity with white acceleration up to time `to`; does nothing backwards. While it is
  /// not seen, the velocity fades: it may have stopped or turned behind what hides it.
  void Predict(double to, const MotionConfig& config);
  /// Takes over a sighting at the track's time by a camera at p_WC.
  void Correct(const Sighting& sighting, const Eigen::Vector3d& camera);

  /// Standard deviation of the position, the greater one of x and y, m.
  double HorizontalSigma() const;
  /// From the camera when it was last seen, m.
  double Range() const { return (state.position() - p_WC).norm(); }

  Placed Now() const;
  /// Logarithm of how much likelier its way is if it drives than if it stands.
  double LogDrives() const;
  /// Odds of anything else in its place, by its shape.
  double OddsAgainst() const;
  /// True when it is surely of the target's shape.
  bool Alike() const;
  /// True when it is surely the target and drives, rather than something of another shape or its
  /// like that stands.
  bool Drives() const;
};

/// What is first seen at t [s].
Track StartTrack(const Sighting& sighting, double t, const Eigen::Vector3d& p_WC);

/// Covariance of the target's position [m^2, frame W] with what the filter cannot know of itself:
/// the drone's pose, which shifts all measurements alike, the outline's departure from the model
/// (ShapeConfig), which scales the range, and a floor.
Eigen::Matrix3d PublishedCovariance(const Track& track, const PoseSample& pose,
                                    double outline_sigma, const MotionConfig& config);

}  // namespace chase::perception
