#pragma once

#include <limits>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

inline constexpr double kHiddenTime = 3.0;    ///< s over which what is not seen may stop or turn
inline constexpr double kGroundSigma = 0.15;  ///< m that the ground rises or falls meanwhile

/// One thing believed to be the target, followed from frame to frame.
struct TargetTrack {
  TargetGaussian state;  ///< at time t
  TargetShape shape;
  double t = 0.0;     ///< s
  double seen = 0.0;  ///< time of the last correction, s
  int hits = 0, misses = 0;
  bool joined = false;   ///< a like colour went on beyond a side of it when it was last seen
  bool partial = false;  ///< something hid part of it whenever it was seen
  double ranged = -std::numeric_limits<double>::infinity();  ///< when LiDAR last hit it, s

  /// Constant velocity with white acceleration up to time `to`; does nothing backwards. While it is
  /// not seen, the velocity fades: it may have stopped or turned behind what hides it.
  void Predict(double to, const MotionConfig& config);

  /// Takes over a correction at the track's time.
  void Correct(const FitResult& fit);

  /// True when it was seen so often that it is the target and nothing else.
  bool Proven() const;
  /// Standard deviation of the position, the greater one of x and y, m.
  double HorizontalSigma() const;
};

/// What is first seen at t [s].
TargetTrack StartTrack(const FitResult& fit, double t);

/// Covariance of the target's position [m^2, frame W] with what the filter cannot know of itself:
/// the drone's pose, which shifts all measurements alike, the outline's departure from the model
/// (ShapeConfig), which scales the range, and a floor.
Eigen::Matrix3d PublishedCovariance(const TargetTrack& track, const PoseSample& pose,
                                    double outline_sigma, const MotionConfig& config);

}  // namespace chase::perception
