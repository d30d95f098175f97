#pragma once

#include <string>
#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry::test {

/// How the time in a KITTI sweep follows from the azimuth.
struct SweepTiming {
  double cut_azimuth = M_PI;  ///< where the sweep begins, rad
  bool clockwise = true;      ///< seen from above
  bool no_time = false;       ///< all points at the end of the sweep
};

/// Folder of the real recordings, or empty where it is missing.
std::string RecordingsFolder();

/// The 154 sweeps of the recording, 0.1 s each; empty when the file is missing or damaged.
std::vector<Sweep> LoadKittiSweeps(const SweepTiming& timing);

/// The reference poses, first one identity.
std::vector<Pose> LoadKittiReference();

/// Distances between two trajectories of equal length after moving both to start at identity [m].
std::vector<double> ErrorsFromFirstPose(const std::vector<Pose>& estimate,
                                        const std::vector<Pose>& reference);
double RootMeanSquare(const std::vector<double>& values);

}  // namespace chase::odometry::test
